/* The requests that the client makes: paths, values that vary, and what is left of the time. */
#include "harness.h"

#include "request/build.h"
#include "request/paths.h"
#include "show/progress.h"

#include <jansson.h>
#include <unistd.h>

static const char SCENE[] = "{\"problem\": {\"kind\": \"scene\", \"loads\": [{\"on\": \"top\", \"traction\": [0, 1]}],"
                            " \"thickness\": 5}, \"tags\": [\"a\"]}";

/* ------------------------------------------------------------------- paths */

/* What is at the path, as JSON; "" and the message where there is nothing. Lives until the next call. */
static const char *at(const char *text, char message[1024])
{
    static char found[256];
    client_path path;
    json_t *request = json_loads(SCENE, 0, NULL);
    found[0] = message[0] = '\0';
    json_t *value = client_path_read(&path, request, text, strlen(text), message, 1024)
                        ? client_path_get(&path, request, message, 1024)
                        : NULL;
    char *dumped = value ? json_dumps(value, JSON_COMPACT | JSON_ENCODE_ANY) : NULL;
    snprintf(found, sizeof found, "%s", dumped ? dumped : "");
    free(dumped);
    json_decref(request);
    return found;
}

TEST(paths_lead_to_values)
{
    static const char *const CASES[][2] = {
        {"loads.0.traction.1", "1"}, {"problem.loads.0.on", "\"top\""}, {"thickness", "5"},
        {"tags.0", "\"a\""},         {"problem.thickness", "5"},        {"loads.0.traction", "[0,1]"},
    };
    char message[1024];
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++)
        CHECK_STR(at(CASES[i][0], message), CASES[i][1]);
}

TEST(paths_that_lead_nowhere_say_what_is_there)
{
    static const char *const CASES[][2] = {
        {"load.0", "it has: kind, loads, thickness"},
        {"loads.1", "0 to 0"},
        {"loads.-1", "none of its indices"},
        {"loads.0.traction.1.x", "is a single value"},
        {"solver.method", "solver"},
        {"loads.0x", "none of its indices"},
        {"loads.99999999999999999999", "none of"},
        {"loads.", "is no path"},
        {".loads", "is no path"},
        {"", "empty"},
    };
    char message[1024];
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        CHECK_STR(at(CASES[i][0], message), "");
        CHECK_MSG(strstr(message, CASES[i][1]), "\"%s\" said: %s", CASES[i][0], message);
    }
}

/* ------------------------------------------------------------------ values */

TEST(values_that_vary)
{
    static const char *const CASES[][2] = {
        {"0.1:0.5:5", "[0.1,0.2,0.3,0.4,0.5]"},
        {"0:1:3", "[0,0.5,1]"},
        {"10:40:4", "[10,20,30,40]"},
        {"1:-1:3", "[1,0,-1]"},
        {"1e-3:3e-3:3", "[0.001,0.002,0.003]"},
        {"1,2.5,1e3", "[1,2.5,1000.0]"},
        {"quad4,tri3", "[\"quad4\",\"tri3\"]"},
        {"quick", "[\"quick\"]"},
        {"[1,2],[3,4]", "[[1,2],[3,4]]"},
        {"true,null", "[true,null]"},
        {"auto,7", "[\"auto\",7]"},
    };
    char message[400];
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        json_t *values = client_vary_values(CASES[i][0], message, sizeof message);
        char *dumped = json_dumps(values, JSON_COMPACT | JSON_REAL_PRECISION(15));
        CHECK_STR(dumped ? dumped : message, CASES[i][1]);
        free(dumped);
        json_decref(values);
    }
}

TEST(values_that_vary_and_are_none)
{
    static const char *const BAD[] = {"",      ",",       "1,,2",  "1,",      "1:2",
                                      "1:2:1", "1:2:3:4", "1:2:x", "1:nan:3", "1:2:20000"};
    char message[400];
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        json_t *values = client_vary_values(BAD[i], message, sizeof message);
        CHECK_MSG(!values, "accepted: %s", BAD[i]);
        json_decref(values);
    }
}

/* ------------------------------------------------------------------- time */

static bool near(double got, double want, double within)
{
    return fabs(got - want) <= within;
}

static void row(client_progress *p, double percent, double bound)
{
    json_t *event = json_pack("{s:f, s:f, s:f, s:f}", "progress", percent, "iteration", 1.0, "dual_objective", 0.5,
                              "error_bound", bound);
    client_progress_row(p, event);
    json_decref(event);
}

TEST(time_left_follows_the_slope)
{
    client_progress p = client_progress_new(stderr, false, true);
    double now = p.start + 10;
    CHECK(isnan(client_progress_left(&p, now)));
    row(&p, 10, 1);
    row(&p, 27, 0.1);
    row(&p, 44, 0.01);
    CHECK(near(p.relative, 0.01, 1e-12));
    /* Two of five decades took two seconds: three are left. */
    p.at[0] = p.start + 8;
    p.at[1] = p.start + 9;
    p.at[2] = p.start + 10;
    CHECK(near(client_progress_left(&p, now), 3, 1e-9));
    /* Where the error does not fall, the per cents tell. */
    p.value[2] = p.value[0];
    p.percent = 50;
    CHECK(near(client_progress_left(&p, now), 10, 1e-9));
    CHECK(isnan(client_progress_left(&p, p.start + 0.5)));
}

TEST(time_left_of_a_long_run_is_of_its_end)
{
    client_progress p = client_progress_new(stderr, false, true);
    for (int i = 0; i < 3 * CLIENT_PROGRESS_SAMPLES; i++) {
        row(&p, 10 + 85 * 0.5 * i / (3 * CLIENT_PROGRESS_SAMPLES - 1), pow(10, -i / 10.0));
        p.at[i % CLIENT_PROGRESS_SAMPLES] = p.start + (i < 64 ? i : 64 + (i - 64) * 0.5);
    }
    /* Half of the way is left, 9.5 decades at two tenths of one in half a second. */
    CHECK(near(client_progress_left(&p, p.start + 100), 9.5 / 0.2, 1e-6));
}

TEST(columns_of_no_terminal)
{
    FILE *file = fopen("/dev/null", "w");
    unsetenv("COLUMNS");
    CHECK_INT(client_columns(file, 77), 77);
    setenv("COLUMNS", "31", 1);
    CHECK_INT(client_columns(file, 77), 31);
    setenv("COLUMNS", "-3", 1);
    CHECK_INT(client_columns(file, 77), 77);
    unsetenv("COLUMNS");
    fclose(file);
}
