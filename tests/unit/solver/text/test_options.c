/* A table of options: values of every kind, the walk over a command line, what people are told. */
#include "harness.h"
#include "text/options.h"

#include <stdlib.h>

typedef struct {
    bool flag, on;
    int integer, level;
    double number;
    size_t bytes, count;
    char text[UZ_OPTION_ROOM], list[UZ_OPTION_ROOM];
    const char *word, *choice;
    uz_words words;
} values;

static bool is_letter(const char *word)
{
    return strlen(word) == 1;
}

#define ROW(NAME, LETTER, KIND, MEMBER, ...)                                                                           \
    {                                                                                                                  \
        .name = NAME, .letter = LETTER, .kind = UZ_OPTION_##KIND, .offset = offsetof(values, MEMBER), __VA_ARGS__      \
    }
static const uz_option ROWS[] = {
    ROW("flag", 'f', FLAG, flag, .places = 1, .about = "a flag"),
    ROW("on", 0, SWITCH, on, .places = 1, .normal = "no"),
    ROW("max-integer", 'i', INTEGER, integer, .places = 1, .least = -2, .most = 9, .value = "N",
        .about = "an integer that is explained at some length, so that its line must be broken"),
    ROW("max-number", 0, NUMBER, number, .places = 1, .most = 9.5, .unit = "days"),
    ROW("bytes", 0, BYTES, bytes, .places = 1, .least = 1),
    ROW("count", 0, COUNT, count, .places = 1),
    ROW("text", 't', TEXT, text, .places = 1),
    ROW("list", 0, LIST, list, .places = 1, .most = 2, .check = is_letter, .wants = "letters"),
    ROW("level", 0, LEVEL, level, .places = 1, .choices = "low middle high"),
    ROW("word", 0, WORD, word, .places = 1),
    ROW("word", 'w', FLAG, flag, .places = 2),
    ROW("choice", 0, CHOICE, choice, .places = 2, .choices = "a b"),
    ROW("words", 0, WORDS, words, .places = 2, .most = 2, .value = "WORD"),
};
static const uz_option_table TABLE = {ROWS, sizeof ROWS / sizeof ROWS[0]};

static bool set(values *v, const char *name, const char *text)
{
    return uz_option_set(v, uz_option_find(TABLE, 3, name, strlen(name)), text);
}

TEST(values_are_read)
{
    values v = {0};
    CHECK(set(&v, "flag", NULL) && v.flag && set(&v, "on", NULL) && v.on && set(&v, "on", "false") && !v.on);
    CHECK(set(&v, "max-integer", "-2") && v.integer == -2 && set(&v, "max-number", "1e0") && v.number == 1);
    CHECK(set(&v, "bytes", "3K") && v.bytes == 3072 && set(&v, "count", "3K") && v.count == 3000);
    CHECK(set(&v, "text", "some text") && strcmp(v.text, "some text") == 0);
    CHECK(set(&v, "list", "  a\tb ") && strcmp(v.list, "a b") == 0 && set(&v, "list", "") && !v.list[0]);
    CHECK(set(&v, "level", "high") && v.level == 2 && set(&v, "choice", "b") && strcmp(v.choice, "b") == 0);
    CHECK(set(&v, "words", "x") && set(&v, "words", "y") && v.words.count == 2 && strcmp(v.words.item[1], "y") == 0);
}

TEST(values_are_refused_and_nothing_is_changed)
{
    static const char *const WRONG[][2] = {{"on", "maybe"},       {"on", ""},
                                           {"max-integer", "-3"}, {"max-integer", "10"},
                                           {"max-integer", "1x"}, {"max-integer", ""},
                                           {"max-number", "9.6"}, {"max-number", "nan"},
                                           {"max-number", "-1"},  {"bytes", "0"},
                                           {"bytes", "-1"},       {"bytes", "1KK"},
                                           {"bytes", "1T"},       {"bytes", "9999999999G"},
                                           {"text", ""},          {"list", "a bb"},
                                           {"list", "a b c"},     {"level", "lo"},
                                           {"level", ""},         {"word", ""},
                                           {"choice", "c"},       {"choice", "a b"},
                                           {"words", ""}};
    values v = {.integer = 5, .number = 2.5, .bytes = 7, .level = 1}, before = v;
    char wants[200];
    for (size_t i = 0; i < sizeof WRONG / sizeof WRONG[0]; i++) {
        CHECK_MSG(!set(&v, WRONG[i][0], WRONG[i][1]), "%s took %s", WRONG[i][0], WRONG[i][1]);
        CHECK_MSG(memcmp(&v, &before, sizeof v) == 0, "%s", WRONG[i][0]);
        uz_option_wants(wants, sizeof wants, uz_option_find(TABLE, 3, WRONG[i][0], strlen(WRONG[i][0])));
        CHECK_MSG(wants[0], "%s", WRONG[i][0]);
    }
    CHECK(set(&v, "words", "x") && set(&v, "words", "y") && !set(&v, "words", "z"));
}

/* The steps of a command line as letters, with the names and values that were found. */
static const char *walk(bool abbreviated, unsigned places, int argc, char **argv)
{
    static char out[400];
    uz_option_walk w = {.table = TABLE, .places = places, .abbreviated = abbreviated, .argc = argc, .argv = argv};
    size_t used = 0;
    out[0] = '\0';
    for (uz_walk_step step; (step = uz_option_next(&w)) != UZ_WALK_END;)
        used += (size_t)snprintf(out + used, sizeof out - used, "%c%s%s%s ", ".OaUL"[step],
                                 step == UZ_WALK_OPTION || step == UZ_WALK_LACKS ? w.row->name : w.word,
                                 w.value ? "=" : "", w.value ? w.value : "");
    return out;
}
#define WALK(ABBREVIATED, PLACES, ...)                                                                                 \
    walk(ABBREVIATED, PLACES, (int)(sizeof((char *[]){__VA_ARGS__}) / sizeof(char *)), (char *[]){__VA_ARGS__})

TEST(a_command_line_is_walked)
{
    CHECK_STR(WALK(false, 1, "p", "a", "--flag", "--text", "x", "--text=y=z", "-t", "w", "-", "--on", "--on=no", "b"),
              "aa Oflag Otext=x Otext=y=z Otext=w a- Oon Oon=no ab ");
    CHECK_STR(WALK(false, 1, "p", "--", "--flag", "--"), "a--flag a-- ");
    CHECK_STR(WALK(false, 1, "p", "--nothing", "-z", "-ft", "--flag=3", "--text"),
              "U--nothing U-z U-ft Oflag=3 Ltext ");
    CHECK_STR(WALK(false, 1, "p"), "");
}

TEST(rows_of_the_place_come_first_and_beginnings_do_where_allowed)
{
    CHECK_STR(WALK(false, 1, "p", "--word", "x"), "Oword=x ");
    CHECK_STR(WALK(false, 2, "p", "--word", "x"), "Oword ax ");
    CHECK_STR(WALK(false, 1, "p", "-w", "x"), "Oword ax "); /* of another place, which the caller refuses */
    CHECK_STR(WALK(true, 1, "p", "--fl", "--max-i", "3", "--max", "4"), "Oflag Omax-integer=3 U--max a4 ");
    CHECK_STR(WALK(false, 1, "p", "--fl"), "U--fl ");
}

TEST(the_environment_and_close_names)
{
    char name[64];
    const uz_option *row = uz_option_find(TABLE, 1, "max-integer", strlen("max-integer"));
    setenv("TEST_MAX_INTEGER", "7", 1);
    CHECK_STR(uz_option_environment(row, "TEST_", name), "7");
    CHECK_STR(name, "TEST_MAX_INTEGER");
    unsetenv("TEST_MAX_INTEGER");
    CHECK(!uz_option_environment(row, "TEST_", name) && !uz_option_find(TABLE, 2, "max-integer", 11));
    CHECK_STR(uz_option_closest(TABLE, 1, "max-intger=3", 10), "max-integer");
    CHECK(!uz_option_closest(TABLE, 2, "max-integer", 11));
}

TEST(options_are_explained)
{
    char text[600] = "";
    FILE *to = fmemopen(text, sizeof text, "w");
    uz_option_print(to, &ROWS[2], ROWS[2].about, 24, 60, true);
    uz_option_print(to, &ROWS[2], ROWS[2].about, 12, 40, false);
    CHECK_STR(uz_write_wrapped(to, "one two three\nfour", 2, "# ", 2, 10), "four");
    fclose(to);
    CHECK_STR(text, "  -i, --max-integer N   an integer that is explained at some\n"
                    "                        length, so that its line must be\n"
                    "                        broken\n"
                    "  --max-integer N\n"
                    "            an integer that is explained\n"
                    "            at some length, so that its\n"
                    "            line must be broken\n"
                    "one two\n# three");
}
