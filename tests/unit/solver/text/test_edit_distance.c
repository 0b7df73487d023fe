/* The word that was probably meant. */
#include "harness.h"
#include "text/edit_distance.h"

static const char *const WORDS[] = {"submit", "status", NULL, "--K", "--N", "max-body", "max-rows"};
enum { N_WORDS = sizeof WORDS / sizeof WORDS[0] };

static int closest(const char *text)
{
    return uz_closest(text, strlen(text), WORDS, N_WORDS);
}

TEST(one_edit_and_one_more_for_each_four_letters)
{
    CHECK_INT(closest("submit"), 0);
    CHECK_INT(closest("submti"), 0); /* a swap is one edit */
    CHECK_INT(closest("sbmt"), 0);
    CHECK_INT(closest("sbm"), -1);
    CHECK_INT(closest("staus"), 1);
    CHECK_INT(closest("max-boddy"), 5);
    CHECK_INT(closest("max-bo"), 5);
    CHECK_INT(closest("nothing"), -1);
}

TEST(case_is_no_edit_and_the_first_of_several_is_taken)
{
    CHECK_INT(closest("--n"), 4);
    CHECK_INT(closest("SUBMIT"), 0);
    CHECK_INT(closest("--x"), 3);
    CHECK_INT(closest("max-bows"), 6);
}

TEST(short_and_long_words_are_close_to_none)
{
    static const char LONG[] = "submitsubmitsubmitsubmitsubmitsubmitsubmit";
    CHECK_INT(closest(""), -1);
    CHECK_INT(closest("x"), -1);
    CHECK_INT(closest(LONG), -1);
    CHECK_INT(uz_closest("submit", 6, (const char *const[]){LONG}, 1), -1);
    CHECK_INT(uz_closest("submit", 6, NULL, 0), -1);
    CHECK_INT(uz_closest("submitted", 6, WORDS, N_WORDS), 0); /* the length counts, not a NUL */
}
