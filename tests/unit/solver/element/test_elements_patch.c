/* The patch test of all elements. */
#include "element_accuracy.h"
#include "harness.h"

static void check_patch(const uz_element *element, double scale)
{
    const double worst = patch_error(element, scale);
    CHECK_MSG(worst < 1e-12, "%s: off by %g of its size, %g", element_words(element), worst, scale);
}

TEST(every_element_passes)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++)
        check_patch(&element, 1);
}

/* As a nearly incompressible material asks for, where the formulation is for it. */
TEST(mean_dilatation_passes_for_rubber)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.4999); i++)
        if (element.formulation == UZ_FORMULATION_BBAR)
            check_patch(&element, 1);
}

TEST(in_other_units_too)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        check_patch(&element, 1e-9);
        check_patch(&element, 1e6);
    }
}
