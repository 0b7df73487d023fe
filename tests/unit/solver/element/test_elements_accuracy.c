/* Orders of convergence of all elements. */
#include "element_accuracy.h"
#include "harness.h"

TEST(errors_fall_with_the_degree)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double errors[2];
        const double order = convergence_order(errors, &element);
        CHECK_MSG(fabs(order - element_degree(&element)) < 0.1, "%s: errors %g, %g, order %.2f, want %d",
                  element_words(&element), errors[0], errors[1], order, element_degree(&element));
    }
}
