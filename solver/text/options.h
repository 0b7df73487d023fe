/* options.h: what a program can be told, as one table: its rows are read from a command line, an environment or a file
 * and explained to people. The daemon (server/options) and the client (client/options) each have a table. */
#ifndef UZ_TEXT_OPTIONS_H
#define UZ_TEXT_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

enum { UZ_OPTION_ROOM = 1024, UZ_OPTION_MOST_WORDS = 64 };

/* The type of a value is that of the member that it is put into. */
typedef enum {
    UZ_OPTION_FLAG,    /* bool: true where it is given; takes no value */
    UZ_OPTION_SWITCH,  /* bool: yes or no; given alone it means yes where the default is no */
    UZ_OPTION_INTEGER, /* int from least to most */
    UZ_OPTION_NUMBER,  /* double from least to most (0: no end), finite, of `unit` */
    UZ_OPTION_BYTES,   /* size_t, at least `least`; the suffixes K, M and G are powers of 1024 */
    UZ_OPTION_COUNT,   /* the same with powers of 1000 */
    UZ_OPTION_TEXT,    /* char[UZ_OPTION_ROOM]; empty only where the default is */
    UZ_OPTION_LIST,    /* char[UZ_OPTION_ROOM]: at most `most` words, each accepted by `check`, single spaces between */
    UZ_OPTION_LEVEL,   /* int: which one of `choices` */
    UZ_OPTION_WORD,    /* const char *: the text as it was given, not empty */
    UZ_OPTION_CHOICE,  /* const char *: one of `choices` */
    UZ_OPTION_WORDS    /* uz_words: one more each time it is given, at most `most` */
} uz_option_kind;

typedef struct {
    const char *item[UZ_OPTION_MOST_WORDS]; /* as they were given */
    int count;
} uz_words;

typedef struct {
    const char *name; /* without dashes */
    char letter;      /* 0: no short form */
    uz_option_kind kind;
    size_t offset;                   /* of its member in the struct of all values */
    unsigned places;                 /* bits that the program gives a meaning, such as commands that it belongs to */
    double least, most;              /* of the kinds that say so */
    const char *value;               /* what its value is called; NULL: it takes none */
    const char *choices;             /* words with spaces between; of other kinds than CHOICE and LEVEL some examples */
    bool (*check)(const char *word); /* of a LIST; `wants` then says what it accepts */
    const char *wants;
    const char *normal; /* the default as text; NULL: none, or computed as `otherwise` says */
    const char *otherwise;
    const char *unit;  /* of a limit; NULL: it is none */
    bool zero_is_off;  /* of a limit */
    const char *about; /* one sentence; lines are broken where it is printed */
} uz_option;

typedef struct {
    const uz_option *rows;
    size_t count;
} uz_option_table;

/* Gives a value to the option; text NULL: it was given without one. False: *values is as before, and uz_option_wants
 * says why. */
bool uz_option_set(void *values, const uz_option *row, const char *text);
/* What the option takes, to be put behind "wants": "an integer from 1 to 9". */
void uz_option_wants(char *out, size_t size, const uz_option *row);

/* The row of that name and one of these places; NULL: none. */
const uz_option *uz_option_find(uz_option_table table, unsigned places, const char *name, size_t len);
/* The name that was probably meant among the rows of these places; NULL: none is close. */
const char *uz_option_closest(uz_option_table table, unsigned places, const char *name, size_t len);
/* What the environment says: of "max-body" and the prefix "UZAWAD_" the variable UZAWAD_MAX_BODY, put into name. NULL:
 * nothing. */
const char *uz_option_environment(const uz_option *row, const char *prefix, char name[64]);

/* ---- a walk over a command line */

/* Begin with the members of the first group; each step fills those of the last. */
typedef struct {
    uz_option_table table;
    unsigned places;  /* of several rows of a name one of these places is taken before others */
    bool abbreviated; /* a beginning that only one long name has will do */
    int argc;
    char *const *argv;

    int next;   /* index of the next word, less 1 */
    bool ended; /* "--" was passed */

    const char *word; /* as it stands there */
    const uz_option *row;
    const char *value; /* NULL: none */
} uz_option_walk;

typedef enum {
    UZ_WALK_END,
    UZ_WALK_OPTION,
    UZ_WALK_OPERAND, /* "-" is one too */
    UZ_WALK_UNKNOWN, /* there is no such option */
    UZ_WALK_LACKS    /* the option needs a value */
} uz_walk_step;

/* "--name VALUE", "--name=VALUE", "-n VALUE"; "--" ends the options. */
uz_walk_step uz_option_next(uz_option_walk *walk);

/* ---- for people */

/* Writes words up to a line break or the end, the first from column `at`, and breaks lines before `width`; later lines
 * begin with `margin`, `indent` columns wide. Returns what follows the line break. */
const char *uz_write_wrapped(FILE *to, const char *text, int at, const char *margin, int indent, int width);
/* "  -n, --name VALUE" and from `column` on what it means. letters: leave room for short forms. */
void uz_option_print(FILE *to, const uz_option *row, const char *about, int column, int width, bool letters);

#endif
