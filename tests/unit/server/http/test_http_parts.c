/* The parts of server/http and the command line that need no socket. */
#include "harness.h"
#include "http/transport/deadlines.h"
#include "http/api.h"
#include "http/transport/framing.h"
#include "options/options.h"

#include <sys/socket.h>
#include <unistd.h>

/* ------------------------------------------------------------------ target */

static bool parses(const char *raw)
{
    target t;
    problem_details problem = {0};
    bool ok = target_parse(&t, raw, &problem);
    CHECK_MSG(ok ? problem.status == 0 : problem.status == 400 && !t.text, "%s", raw);
    target_clear(&t);
    return ok;
}

TEST(target_is_split_and_decoded)
{
    target t;
    problem_details problem;
    CHECK(target_parse(&t, "/v1/j%6fbs?limit=5&tag=a%20b+c&validate&x=", &problem));
    CHECK_STR(t.path, "/v1/jobs");
    CHECK_INT(t.count, 4);
    CHECK_STR(target_value(&t, "limit"), "5");
    CHECK_STR(target_value(&t, "tag"), "a b c");
    CHECK_STR(target_value(&t, "validate"), "");
    CHECK(!target_value(&t, "lim"));
    target_clear(&t);
    CHECK(target_parse(&t, "HTTP://host:80/a+b?", &problem));
    CHECK_STR(t.path, "/a+b");
    CHECK_INT(t.count, 0);
    target_clear(&t);
    target_clear(&t);
}

TEST(malformed_targets_are_refused)
{
    static const char *const WRONG[] = {"",     "jobs", "*",     "http://host", "http://h?x=1/", "/%",
                                        "/%0",  "/%00", "/%zz",  "/a?b=%",      "/a?%00=1",      "/a?b=1&b=2",
                                        "/a#b", "/a b", "/\x7f", "/\xc3\xa9",   "/a?b=\x01",     "ftp://h/a"};
    for (size_t i = 0; i < sizeof WRONG / sizeof WRONG[0]; i++)
        CHECK_MSG(!parses(WRONG[i]), "accepted %s", WRONG[i]);
    CHECK(parses("/a?1&2&3&4&5&6&7&8&9&10&11&12&13&14&15&16"));
    CHECK(!parses("/a?1&2&3&4&5&6&7&8&9&10&11&12&13&14&15&16&17"));
}

/* ----------------------------------------------------------------- framing */

typedef struct {
    const char *name, *value;
} pair;

static void set_headers(header_list *list, const pair *pairs, size_t count)
{
    list->count = count;
    list->overflow = false;
    for (size_t i = 0; i < count; i++)
        list->fields[i] = (header_field){pairs[i].name, pairs[i].value, strlen(pairs[i].name), strlen(pairs[i].value)};
}

static int framing_status(const char *version, const pair *pairs, size_t count, framing *out)
{
    header_list list;
    problem_details problem = {0};
    set_headers(&list, pairs, count);
    return framing_read(out, version, &list, &problem) ? 0 : problem.status;
}

TEST(framing_reads_a_length_or_chunks)
{
    framing f;
    CHECK_INT(framing_status("HTTP/1.1", (pair[]){{"host", "x"}, {"content-LENGTH", "0123 "}}, 2, &f), 0);
    CHECK(!f.chunked && f.length == 123);
    CHECK_INT(framing_status("HTTP/1.1", (pair[]){{"Host", "x"}, {"Transfer-Encoding", "Chunked"}}, 2, &f), 0);
    CHECK(f.chunked && f.length == 0);
    CHECK_INT(framing_status("HTTP/1.0", NULL, 0, &f), 0);
    CHECK(!f.chunked && f.length == 0);
}

TEST(ambiguous_framing_is_refused)
{
    framing f;
    static const struct {
        pair second, third;
        int status;
    } WRONG[] = {
        {{"Content-Length", "2"}, {"Transfer-Encoding", "chunked"}, 400},
        {{"Content-Length", "2"}, {"Content-Length", "2"}, 400},
        {{"Content-Length", ""}, {"A", "b"}, 400},
        {{"Content-Length", "+1"}, {"A", "b"}, 400},
        {{"Content-Length", "1234567890123456789"}, {"A", "b"}, 400},
        {{"Transfer-Encoding", "gzip, chunked"}, {"A", "b"}, 400},
        {{"Host", "y"}, {"A", "b"}, 400},
        {{"Authorization", "Bearer x"}, {"authorization", "Bearer x"}, 400},
        {{"Content-Length ", "2"}, {"A", "b"}, 400},
        {{"", "2"}, {"A", "b"}, 400},
        {{"A", "b\rc"}, {"A", "b"}, 400},
        {{"Expect", "200-ok"}, {"A", "b"}, 417},
        {{"Expect", "100-Continue"}, {"A", "b\tc"}, 0},
    };
    for (size_t i = 0; i < sizeof WRONG / sizeof WRONG[0]; i++) {
        int got = framing_status("HTTP/1.1", (pair[]){{"Host", "x"}, WRONG[i].second, WRONG[i].third}, 3, &f);
        CHECK_MSG(got == WRONG[i].status, "%zu: %d, not %d", i, got, WRONG[i].status);
    }
    CHECK_INT(framing_status("HTTP/1.1", NULL, 0, &f), 400);
    CHECK_INT(framing_status("HTTP/2", NULL, 0, &f), 505);
    CHECK_INT(framing_status("HTTP/1.0", (pair[]){{"Transfer-Encoding", "chunked"}}, 1, &f), 400);
}

TEST(a_host_is_a_name_or_an_address)
{
    framing f;
    static const char *const GOOD[] = {"", "x", "x:80", "[::1]:8080", "a.b-c_d.example:1 ", "%41", "127.0.0.1"},
                             *const BAD[] = {"a b", "a/b", "http://a", "user@a", "a?b", "a#b", "\xc3\xa9", "a\tb"};
    for (size_t i = 0; i < sizeof GOOD / sizeof GOOD[0]; i++)
        CHECK_MSG(framing_status("HTTP/1.1", (pair[]){{"Host", GOOD[i]}}, 1, &f) == 0, "%s", GOOD[i]);
    for (size_t i = 0; i < sizeof BAD / sizeof BAD[0]; i++)
        CHECK_MSG(framing_status("HTTP/1.1", (pair[]){{"Host", BAD[i]}}, 1, &f) == 400, "%s", BAD[i]);
}

TEST(space_behind_a_value_is_none_of_it)
{
    framing f;
    header_list list;
    problem_details problem = {0};
    set_headers(&list, (pair[]){{"Host", "x \t "}, {"A", " "}, {"B", "b c"}, {"Expect", "100-continue "}}, 4);
    CHECK(framing_read(&f, "HTTP/1.1", &list, &problem));
    CHECK(list.fields[0].value_len == 1 && list.fields[1].value_len == 0 && list.fields[2].value_len == 3);
    set_headers(&list, (pair[]){{"Host", "x"}, {"Transfer-Encoding", "chunked "}}, 2);
    CHECK(!framing_read(&f, "HTTP/1.1", &list, &problem) && problem.status == 400);
    list.count = 1;
    char block[] = "GET\0/a\0HTTP/1.1\0\0Host\0 x \t\0\0\0\0"; /* the layout allows it too */
    list.fields[0] = (header_field){block + 17, block + 23, 4, 1};
    framing_layout layout = {block, block + 4, block + 7, 2, sizeof block - 1};
    CHECK(framing_tiles(&layout, &list));
}

/* Whether a chunked body is taken, whole and byte by byte alike; *beyond is what came behind it. */
static bool chunks_good(const char *text, size_t size, uint64_t *beyond)
{
    chunk_follower whole = {.digits = 0}, single = {.digits = 0};
    bool good = true;
    const bool taken = chunks_follow(&whole, text, size);
    for (size_t i = 0; i < size && good; i++)
        good = chunks_follow(&single, text + i, 1);
    CHECK(good == taken);
    CHECK(!good || (whole.state == single.state && whole.beyond == single.beyond));
    *beyond = whole.state == CHUNKS_DONE ? whole.beyond : 1000;
    return taken;
}

TEST(chunked_bodies_are_followed)
{
    static const struct {
        const char *text;
        uint64_t beyond; /* 1000: the body is not at its end */
        bool good;
    } BODIES[] = {
        {"5\r\nhello\r\n0\r\n\r\nGET", 3, true},
        {"A;x=\"y\"\r\n0123456789\r\n000\r\nX: y\r\nZ:\r\n\r\n", 0, true},
        {"5\r\nhel", 1000, true},
        {"00000000000000b\r\n\r\n\r\n\r\n\r\n\r\n\r\r\n0\r\n\r\n", 0, true},
        {"5\nhello", 0, false},
        {"5\r\nhello\n0", 0, false},
        {"5\r\nhello0\r\n", 0, false},
        {"0\n\r\n", 0, false},
        {"0\r\n\n", 0, false},
        {"0\r\nX: y\n\r\n", 0, false},
        {"0\r\n X: y\r\n\r\n", 0, false},
        {"1;a\nb", 0, false},
        {"ffffffffffffffff\r\n", 0, false},
        {"-1\r\n", 0, false},
        {"\r\n", 0, false},
        {"g", 0, false},
    };
    for (size_t i = 0; i < sizeof BODIES / sizeof BODIES[0]; i++) {
        uint64_t beyond = 0;
        const bool good = chunks_good(BODIES[i].text, strlen(BODIES[i].text), &beyond);
        CHECK_MSG(good == BODIES[i].good && (!good || beyond == BODIES[i].beyond), "%zu: %d, %llu", i, good,
                  (unsigned long long)beyond);
    }
    uint64_t beyond;
    CHECK(chunks_good("2\r\n\0\n\r\n0\r\n\r\n", 12, &beyond) && beyond == 0);
    CHECK(!chunks_good("2;\0\r\n", 6, &beyond));
}

/* A block as the parser leaves it: '0' stands for NUL. */
static bool tiles(const char *text)
{
    char block[128];
    size_t len = strlen(text);
    header_list list = {0};
    for (size_t i = 0; i <= len; i++)
        block[i] = text[i] == '0' ? '\0' : text[i];
    framing_layout layout = {block, block + 4, block + 7, 2, len};
    char *name = strchr(block + 7, '\0') + 2;
    while (name < block + len && *name) { /* name NUL spaces value NUL NUL */
        char *value = name + strlen(name) + 1;
        value += strspn(value, " \t");
        list.fields[list.count++] = (header_field){name, value, strlen(name), strlen(value)};
        name = value + strlen(value) + 2;
    }
    return framing_tiles(&layout, &list);
}

TEST(header_blocks_must_tile)
{
    CHECK(tiles("GET0/a0HTTP/1.100Host0 x00A0b0000"));
    CHECK(tiles("GET0/a0HTTP/1.100Host0x00A0\t b 0000"));
    CHECK(!tiles("GET0/a0HTTP/1.100Host0 x0A0b0000"));        /* bare LF */
    CHECK(!tiles("GET0/a0HTTP/1.100Host0 x0b00A0b0000"));     /* NUL in a value */
    CHECK(!tiles("GET0/a00HTTP/1.100Host0 x0000"));           /* two spaces */
    CHECK(!tiles("GET0/a0HTTP/1.100Host0 x00A0b00C0d0000Z")); /* the block is longer than its parts */
}

/* ----------------------------------------------------------- header fields */

static double wait_of(const char *value)
{
    http_request rq = {0};
    set_headers(&rq.headers, (pair[]){{"prefer", value}}, 1);
    return request_wait(&rq, 0, 60);
}

TEST(prefer_wait_is_read)
{
    CHECK(wait_of("wait=7") == 7);
    CHECK(wait_of("respond-async, Wait = 8 ; x=\"a,b\", wait=9") == 8);
    CHECK(wait_of("x=\"wait=3, wait=4\", wait=\"5\"") == 5);
    CHECK(wait_of("wait=100") == 60);
    CHECK(wait_of("wait=-1") == 0 && wait_of("wait=") == 0 && wait_of("wait") == 0 && wait_of("waits=3") == 0);
    CHECK(wait_of("wait=1.5") == 0 && wait_of("") == 0 && wait_of("x=\"wait=3") == 0 && wait_of(",,;=") == 0);
}

static bool accepts(const char *value)
{
    http_request rq = {0};
    set_headers(&rq.headers, (pair[]){{"accept", value}}, 1);
    return request_accepts(&rq, "text/csv");
}

TEST(accept_is_read)
{
    CHECK(accepts("text/csv") && accepts("a/b, Text/CSV;q=0.1") && accepts("text/csv; header=present"));
    CHECK(!accepts("*/*") && !accepts("text/csvx") && !accepts("text/csv;q=0") && !accepts("text/csv; a=b; q=0.000"));
    CHECK(!accepts("") && !accepts("a/b;x=\"text/csv, text/csv\""));
}

/* ------------------------------------------------------------------ routes */

static int route_status(const char *method, const char *path, char *allow, size_t size)
{
    http_request rq = {.target = {.path = path}};
    problem_details problem = {0};
    snprintf(rq.method, sizeof rq.method, "%s", method);
    return route_find(&rq, allow, size, &problem) ? 0 : problem.status;
}

TEST(routes_are_found)
{
    char allow[64];
    CHECK_INT(route_status("GET", "/v1/jobs", allow, sizeof allow), 0);
    CHECK_INT(route_status("HEAD", "/v1/jobs/0123456789abcdef0123456789abcdef/history.csv", allow, sizeof allow), 0);
    CHECK_INT(route_status("GET", "/v1/jobs/0123456789abcdef0123456789abcde", allow, sizeof allow), 404);
    CHECK_INT(route_status("GET", "/v1/jobs/0123456789abcdef0123456789abcdeg", allow, sizeof allow), 404);
    CHECK_INT(route_status("GET", "/v1/jobs/", allow, sizeof allow), 404);
    CHECK_INT(route_status("GET", "", allow, sizeof allow), 404);
    CHECK_STR(allow, "");
    CHECK_INT(route_status("PUT", "/v1/jobs", allow, sizeof allow), 405);
    CHECK_STR(allow, "POST, GET, HEAD");
}

/* --------------------------------------------------------------- deadlines */

TEST(a_deadline_cuts_a_connection)
{
    int ends[2];
    char text[64] = "";
    CHECK(socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0);
    deadlines *all = deadlines_new("too late");
    double start = clock_seconds(CLOCK_MONOTONIC);
    deadline *never = deadlines_add(all, -1, INFINITY, NULL, false);
    deadline *d = deadlines_add(all, ends[0], start + 100, ends, false);
    deadline_set(d, start + 0.05, DEADLINE_BODY, true);
    CHECK(!deadline_expired(d));
    CHECK_INT(read(ends[1], text, sizeof text - 1), 8);
    CHECK_STR(text, "too late");
    CHECK_INT(read(ends[1], text, sizeof text), 0);
    double took = clock_seconds(CLOCK_MONOTONIC) - start;
    CHECK_MSG(took > 0.04 && took < 5, "%g", took);
    CHECK(deadline_expired(d) && !deadline_expired(never));
    deadline_remove(d);
    deadline_remove(never);
    deadline_remove(NULL);
    deadlines_free(all);
    close(ends[0]);
    close(ends[1]);
}

TEST(who_waits_for_a_request_makes_room)
{
    int ends[3][2];
    deadline *d[3];
    struct sockaddr_storage from;
    bool spare = true;
    deadlines *all = deadlines_new("");
    for (int i = 0; i < 3; i++) {
        CHECK(socketpair(AF_UNIX, SOCK_STREAM, 0, ends[i]) == 0);
        d[i] = deadlines_add(all, ends[i][0], INFINITY, ends[i], i == 2);
    }
    CHECK(deadlines_owner(all, ends[1][0]) == ends[1] && !deadlines_owner(all, -2));
    deadline_set(d[0], INFINITY, DEADLINE_BODY, false);
    CHECK(deadlines_make_room(all, &from, &spare) && !spare && deadline_expired(d[1]));
    CHECK(deadlines_make_room(all, &from, &spare) && spare && deadline_expired(d[2]));
    CHECK(!deadlines_make_room(all, &from, &spare) && !deadline_expired(d[0]));
    deadline_set(d[0], INFINITY, DEADLINE_IDLE, false);
    CHECK(deadlines_make_room(all, &from, &spare) && deadline_expired(d[0]));
    for (int i = 0; i < 3; i++) {
        CHECK_INT(read(ends[i][1], &(char){0}, 1), 0);
        deadline_remove(d[i]);
        close(ends[i][0]);
        close(ends[i][1]);
    }
    deadlines_free(all);
}

/* -------------------------------------------------------------------- ages */

TEST(ages_do_not_jump_with_the_clock)
{
    const double day = 86400.0, start = 1e9;
    age_clock c = {0};
    CHECK(age_clock_now(&c, start - 10.0, start, 0.0) == start);
    CHECK(age_clock_now(&c, 0.0, start + 100.0, 100.0) == start + 100.0);
    CHECK(age_clock_now(&c, 0.0, start + 250.0, 200.0) == start + 250.0); /* set by a minute: it follows */
    CHECK(age_clock_now(&c, 0.0, start + 1e8, 300.0) == start + 350.0);   /* by years: it goes on */
    CHECK(age_clock_now(&c, 0.0, start + 1e8 + day, 200.0 + day) == start + 250.0 + day);
    CHECK(age_clock_now(&c, 0.0, start + 1e8 + day, 301.0 + day) == start + 1e8 + day); /* for so long: it was right */
    CHECK(age_clock_now(&c, 0.0, start, 303.0 + day) == start); /* back: nothing is older than it is */
    c = (age_clock){0};
    CHECK(age_clock_now(&c, start - 100.0 * day, start, 5.0) == start - 99.0 * day); /* while it did not run */
    CHECK(age_clock_now(&c, 0.0, start + 60.0, 65.0) == start - 99.0 * day + 60.0);
    c = (age_clock){0};
    CHECK(age_clock_now(&c, 0.0, start, 5.0) == start); /* an empty store */
}

/* ----------------------------------------------------------------- options */

static options_verdict parse(server_options *out, char *first, char *second)
{
    char message[256] = "";
    char program[] = "uzawad";
    char *argv[] = {program, first, second, NULL};
    options_verdict verdict = options_read(out, !first ? 1 : !second ? 2 : 3, argv, NULL, message, sizeof message);
    CHECK((verdict == OPTIONS_WRONG) == (message[0] != '\0'));
    return verdict;
}

TEST(options_have_defaults)
{
    server_options o;
    CHECK_INT(parse(&o, NULL, NULL), OPTIONS_RUN);
    CHECK_STR(o.listen, "127.0.0.1:8080");
    CHECK(o.workers >= 1 && o.max_attempts == 3 && o.max_connections == 1024 && o.max_streams == 768 &&
          o.max_body == 64u << 20);
    CHECK(o.drain_s == 30 && o.request_deadline_s == 30 && o.level == LOG_INFO && o.cache >= 1u << 30);
}

TEST(options_are_read_and_checked)
{
    server_options o;
    CHECK_INT(parse(&o, (char[]){"--max-body=3K"}, NULL), OPTIONS_RUN);
    CHECK_INT(o.max_body, 3072);
    CHECK_INT(parse(&o, (char[]){"--log-level"}, (char[]){"warn"}), OPTIONS_RUN);
    CHECK_INT(o.level, LOG_WARN);
    CHECK_INT(parse(&o, (char[]){"--help"}, NULL), OPTIONS_HELP);
    CHECK_INT(parse(&o, (char[]){"--version"}, NULL), OPTIONS_VERSION);
    static const char *const WRONG[] = {
        "--max-body=0", "--max-body=1T", "--max-body=9999999999G", "--workers=-1",   "--workers=", "--drain-s=inf",
        "--drain-s=1x", "--nothing",     "--max-body=KK",          "--log-level=no", "--listen=",  "argument",
        "--db",         "--max-body=-5", "--max-connections=0"};
    for (size_t i = 0; i < sizeof WRONG / sizeof WRONG[0]; i++) {
        char text[64];
        snprintf(text, sizeof text, "%s", WRONG[i]);
        CHECK_MSG(parse(&o, text, NULL) == OPTIONS_WRONG, "accepted %s", WRONG[i]);
    }
}
