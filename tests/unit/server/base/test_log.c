/* Log lines: valid JSON whatever is put in, and whole even from many threads. */
#include "harness.h"
#include "base/log.h"

#include <pthread.h>

typedef struct {
    char *text;
    size_t len;
    FILE *stream;
    server_log log;
} capture;

static void capture_begin(capture *c, log_level least)
{
    memset(c, 0, sizeof *c);
    c->stream = open_memstream(&c->text, &c->len);
    c->log = (server_log){.lock = PTHREAD_MUTEX_INITIALIZER, .stream = c->stream, .least = least};
}

static void capture_end(capture *c)
{
    fclose(c->stream);
    free(c->text);
}

/* What stands after the time, which is checked for its form: {"time": "2026-01-31T23:59:59.999Z", */
static const char *after_time(const char *line)
{
    const char *form = "{\"time\": \"dddd-dd-ddTdd:dd:dd.dddZ\", ";
    for (; *form; form++, line++)
        if (*form == 'd' ? *line < '0' || *line > '9' : *line != *form) {
            test_fail(__FILE__, __LINE__, "no time at \"%.20s\"", line);
            return "";
        }
    return line;
}

TEST(a_line_with_every_kind_of_field)
{
    capture c;
    capture_begin(&c, LOG_INFO);
    log_write(&c.log, LOG_WARN, "job_finished",
              (log_field[]){LOG_S("job", "abc"), LOG_I("rows", -3), LOG_N("seconds", 0.25), {0}});
    CHECK_STR(after_time(c.text),
              "\"level\": \"warn\", \"event\": \"job_finished\", \"job\": \"abc\", \"rows\": -3, \"seconds\": 0.25}\n");
    capture_end(&c);
}

TEST(lower_levels_are_dropped)
{
    capture c;
    capture_begin(&c, LOG_WARN);
    log_write(&c.log, LOG_DEBUG, "a", NULL);
    log_write(&c.log, LOG_INFO, "b", NULL);
    CHECK_INT(c.len, 0);
    log_write(&c.log, LOG_ERROR, "c", NULL);
    CHECK_STR(after_time(c.text), "\"level\": \"error\", \"event\": \"c\"}\n");
    log_write(NULL, LOG_ERROR, "nowhere", NULL);
    capture_end(&c);
}

static void check_string(const char *value, const char *want)
{
    capture c;
    char line[256];
    capture_begin(&c, LOG_DEBUG);
    log_write(&c.log, LOG_DEBUG, "e", (log_field[]){LOG_S("k", value), {0}});
    snprintf(line, sizeof line, "\"level\": \"debug\", \"event\": \"e\", \"k\": %s}\n", want);
    CHECK_STR(after_time(c.text), line);
    capture_end(&c);
}

TEST(strings_stay_valid_json)
{
    check_string("a\"b\\c\nd\te\x01", "\"a\\\"b\\\\c\\u000ad\\u0009e\\u0001\"");
    check_string("Spannung \xcf\x83 \xf0\x9f\x94\xa7", "\"Spannung \xcf\x83 \xf0\x9f\x94\xa7\"");
    check_string(NULL, "null");
    check_string("", "\"\"");
    check_string("\xff", "\"\\ufffd\"");
    check_string("a\xc3", "\"a\\ufffd\"");                                /* cut off by the end */
    check_string("\xe2\x82", "\"\\ufffd\\ufffd\"");                       /* likewise */
    check_string("\xc0\xaf", "\"\\ufffd\\ufffd\"");                       /* overlong */
    check_string("\xe0\x80\xaf", "\"\\ufffd\\ufffd\\ufffd\"");            /* overlong */
    check_string("\xed\xa0\x80", "\"\\ufffd\\ufffd\\ufffd\"");            /* a surrogate */
    check_string("\xf4\x90\x80\x80", "\"\\ufffd\\ufffd\\ufffd\\ufffd\""); /* above U+10FFFF */
}

TEST(numbers_that_json_lacks)
{
    capture c;
    capture_begin(&c, LOG_DEBUG);
    log_write(&c.log, LOG_INFO, "e", (log_field[]){LOG_N("a", NAN), LOG_N("b", -INFINITY), LOG_N("c", 1e-9), {0}});
    CHECK_STR(after_time(c.text), "\"level\": \"info\", \"event\": \"e\", \"a\": null, \"b\": null, \"c\": 1e-09}\n");
    capture_end(&c);
}

static void *write_many(void *arg)
{
    char text[200];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    for (int i = 0; i < 200; i++)
        log_write(arg, LOG_INFO, "e", (log_field[]){LOG_S("text", text), {0}});
    return NULL;
}

TEST(lines_from_many_threads_are_whole)
{
    capture c;
    pthread_t threads[4];
    int lines = 0;
    capture_begin(&c, LOG_INFO);
    for (int i = 0; i < 4; i++)
        CHECK_INT(pthread_create(&threads[i], NULL, write_many, &c.log), 0);
    for (int i = 0; i < 4; i++)
        pthread_join(threads[i], NULL);
    size_t first = strcspn(c.text, "\n");
    for (char *line = c.text; *line; line += first + 1, lines++)
        CHECK(strcspn(line, "\n") == first && line[0] == '{' && line[first - 1] == '}');
    CHECK_INT(lines, 800);
    capture_end(&c);
}
