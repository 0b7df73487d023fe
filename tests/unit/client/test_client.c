/* The client's parts that need no server: command line, tags, files, URLs. */
#include "harness.h"

#include "arguments/arguments.h"
#include "local/files.h"
#include "service/http.h"
#include "request/tags.h"

#include <sys/stat.h>
#include <unistd.h>

/* ------------------------------------------------------------ command line */

#define MOST_WORDS 60

/* Parses "submit a.json --wait" split at blanks. The words live until the next call. */
static bool parse(client_options *out, const char *line, const char *env, char *message)
{
    static char text[1024];
    char *words[MOST_WORDS] = {"uzawa"};
    int count = 1;
    snprintf(text, sizeof text, "%s", line);
    for (char *word = strtok(text, " "); word && count < MOST_WORDS; word = strtok(NULL, " "))
        words[count++] = word;
    return client_arguments_parse(out, count, words, env, message, 256);
}

TEST(arguments_submit)
{
    client_options o;
    char message[256] = "";
    CHECK_MSG(parse(&o, "--server http://h:1 submit --wait --tag a f.json --tag=b -k key --timeout 2.5", NULL, message),
              "%s", message);
    CHECK_INT(o.command, CLIENT_SUBMIT);
    CHECK_STR(o.server, "http://h:1");
    CHECK_STR(o.operand, "f.json");
    CHECK_STR(o.key, "key");
    CHECK_INT(o.tags.count, 2);
    CHECK_STR(o.tags.item[0], "a");
    CHECK_STR(o.tags.item[1], "b");
    CHECK(o.wait && !o.json && !o.quiet);
    CHECK(o.timeout_s == 2.5);
}

TEST(arguments_defaults)
{
    client_options o;
    char message[256] = "";
    CHECK(parse(&o, "submit -", NULL, message));
    CHECK_STR(o.server, "http://127.0.0.1:8080");
    CHECK_STR(o.operand, "-");
    CHECK(isinf(o.timeout_s));
    CHECK(o.retry_s < 0);
    CHECK(parse(&o, "list", "http://env:9", message));
    CHECK_STR(o.server, "http://env:9");
    CHECK(parse(&o, "list", "", message));
    CHECK_STR(o.server, "http://127.0.0.1:8080");
    CHECK(parse(&o, "list -s http://line:7", "http://env:9", message));
    CHECK_STR(o.server, "http://line:7");
}

TEST(arguments_picture)
{
    client_options o;
    char message[256] = "";
    CHECK(parse(&o, "picture j -o p.svg --colour displacements --factor 5 --width 4000 --case a", NULL, message));
    CHECK_INT(o.command, CLIENT_PICTURE);
    CHECK_STR(o.colour, "displacements");
    CHECK_STR(o.factor, "5");
    CHECK_INT(o.width, 4000);
    CHECK_STR(o.case_name, "a");
    CHECK(parse(&o, "picture j", NULL, message) && o.width < 0 && !o.factor && !o.colour);
    CHECK(parse(&o, "result j --format vtu", NULL, message));
    CHECK_STR(o.format, "vtu");
}

TEST(arguments_end_of_options)
{
    client_options o;
    char message[256] = "";
    CHECK(parse(&o, "submit -- --odd", NULL, message));
    CHECK_STR(o.operand, "--odd");
}

TEST(arguments_help_and_version_need_no_operand)
{
    client_options o;
    char message[256] = "";
    CHECK(parse(&o, "submit --help", NULL, message) && o.help && o.command == CLIENT_SUBMIT);
    CHECK(parse(&o, "-h", NULL, message) && o.help && o.command == CLIENT_HELP);
    CHECK(parse(&o, "--version", NULL, message) && o.version);
    CHECK(parse(&o, "help", NULL, message) && o.command == CLIENT_HELP);
}

/* A wrong line and a part of what must be said about it. */
static const char *const REFUSED[][2] = {
    {"", "no command"},
    {"frobnicate", "unknown command"},
    {"submti a", "did you mean \"submit\"?"},
    {"submit a --wiat", "did you mean --wait?"},
    {"submit a --acuracy 1", "unknown option --acuracy"},
    {"submit", "FILE"},
    {"submit a b", "one operand too many"},
    {"list a", "takes no operand"},
    {"status", "ID"},
    {"submit a --frob", "--frob"},
    {"submit a --timeout", "wants a value"},
    {"submit a --timeout x", "--timeout"},
    {"submit a --timeout -1", "--timeout"},
    {"submit a --timeout nan", "--timeout"},
    {"submit a --timeout inf", "--timeout"},
    {"submit a --wait=yes", "takes no value"},
    {"submit a --tag=", "--tag"},
    {"submit a --key=", "--key"},
    {"list --wait", "does not take --wait"},
    {"status x --csv", "does not take --csv"},
    {"list --limit 0", "--limit"},
    {"list --limit 99999999999999999999", "--limit"},
    {"list --limit 3x", "--limit"},
    {"list --tag a --tag b", "one --tag"},
    {"history x --csv --plot", "choose one"},
    {"history x --plot --width 3", "24 to 400"},
    {"--width 401 history --plot x", "24 to 400"},
    {"picture x --width 199", "200 to 4000"},
    {"picture x --width 72.5", "--width"},
    {"picture", "ID"},
    {"picture x --fields a", "does not take --fields"},
    {"upload", "FILE"},
    {"upload x --tag a", "does not take --tag"},
    {"result x --format xml", "json, table, csv, npz, vtu or pvd"},
    {"submit a --progress", "--progress wants --wait"},
    {"submit a --wait --quiet --json", "contradict"},
    {"wait a --quiet --progress", "contradict"},
    {"history x --width 60", "want --plot"},
    {"history x --height 10", "want --plot"},
    {"history x --ascii", "want --plot"},
    {"history x --json --csv", "choose one"},
    {"result x --json --format csv", "contradict"},
    {"picture x --json", "--output FILE"},
    {"plot x --json -o -", "--output FILE"},
    {"plot x --deformed --trade", "choose one"},
    {"plot x --path --trade", "choose one"},
    {"plot x --path --width 1000", "40 to 400 with --path"},
    {"plot x --path -o y", "--path is printed"},
    {"plot x --path --case y", "leave --case out"},
    {"plot x --colour displacements", "want --deformed"},
    {"plot x --trade --factor 3", "want --deformed"},
    {"plot x --width 300", "wants --deformed, --error, --path or --trade"},
    {"plot x --error --width 200", "from 300 to 4000 with --error"},
    {"plot x --error --trade", "choose one"},
    {"plot x --deformed --width 100", "200 to 4000"},
    {"plot x --trade --width 1000", "40 to 400"},
    {"plot x --trade --x seconds", "of the convergence"},
    {"plot x --deformed --with y", "of the convergence"},
    {"plot x --ascii", "wants --path or --trade"},
    {"plot x --trade -o f", "no --output"},
    {"plot x --x frogs", "iterations or seconds"},
    {"help submit --format man", "all commands together"},
    {"submit --K a", "--K and --p"},
    {"submit --K a --p b --N c", "both or neither"},
    {"submit --mesh a", "FILE with the scene"},
    {"submit --surface a", "FILE with the scene"},
    {"submit a --surface b --K c", "choose one"},
    {"submit - --surface -", "only one file"},
    {"submit a --mesh b --p c", "choose one"},
    {"submit - --mesh -", "only one file"},
    {"version --server http://h", "does not take --server"},
    {"refine x", "wants --accuracy"},
    {"status", "an ID"},
    {"history x --format vtu", "does not take --format"},
    {"submit a --tag=1 --tag=2 --tag=3 --tag=4 --tag=5 --tag=6 --tag=7 --tag=8 --tag=9 --tag=10 --tag=11 --tag=12 "
     "--tag=13 --tag=14 --tag=15 --tag=16 --tag=17",
     "at most 16"},
};
TEST(arguments_refused)
{
    for (size_t i = 0; i < sizeof REFUSED / sizeof *REFUSED; i++) {
        client_options o;
        char message[256] = "";
        CHECK_MSG(!parse(&o, REFUSED[i][0], NULL, message), "accepted: %s", REFUSED[i][0]);
        CHECK_MSG(strstr(message, REFUSED[i][1]), "\"%s\" said: %s", REFUSED[i][0], message);
    }
}

/* An operand where one is needed, a value where one is wanted: what is left to be refused is the option itself. */
static bool takes(client_command command, const uz_option *option)
{
    client_options o;
    char message[256] = "", line[200];
    const client_page *page = &CLIENT_PAGES[command];
    const char *value = option->kind == UZ_OPTION_FLAG ? "" : option->kind == UZ_OPTION_CHOICE ? " json" : " 60";
    snprintf(line, sizeof line, "%s %s --%s%s", page->name, page->operands & CLIENT_OPERAND_NEEDED ? "x" : "",
             option->name, value);
    return parse(&o, line, NULL, message) || !strstr(message, "does not take");
}

TEST(arguments_are_refused_by_commands_that_do_not_have_them)
{
    const uz_option_table all = CLIENT_OPTIONS;
    for (size_t i = 0; i < all.count; i++)
        for (int c = 0; c < CLIENT_COMMANDS; c++) {
            const uz_option *option = &all.rows[i];
            bool has = uz_option_find(all, CLIENT_IN(c), option->name, strlen(option->name)) != NULL;
            CHECK_MSG(takes((client_command)c, option) == has, "%s %s", CLIENT_PAGES[(client_command)c].name,
                      option->name);
        }
}

TEST(arguments_of_submit_and_plot)
{
    client_options o;
    char message[256] = "";
    CHECK_MSG(parse(&o, "submit --K k --p p --N n --h h --set a=1 --set b=2 --vary c=1,2 -w", NULL, message), "%s",
              message);
    CHECK_STR(o.h, "h");
    CHECK_INT(o.set.count, 2);
    CHECK_STR(o.vary.item[0], "c=1,2");
    CHECK(parse(&o, "result x --field a --fields b,c --format csv", NULL, message) && o.fields.count == 2);
    CHECK(parse(&o, "plot x --with a --with b --x seconds -o f.png", NULL, message) && o.with.count == 2);
    CHECK(parse(&o, "plot x --trade --width 60 --json", NULL, message) && o.trade);
    CHECK(parse(&o, "--tag a list", NULL, message) && o.tags.count == 1);
    CHECK(parse(&o, "help --format bash", NULL, message));
}

TEST(help_has_a_page_for_each_command)
{
    for (int i = 0; i <= CLIENT_COMMANDS; i++) {
        char *text = NULL;
        size_t len = 0;
        FILE *memory = open_memstream(&text, &len);
        client_help_print(memory, (client_command)i);
        fclose(memory);
        CHECK(strncmp(text, "usage: uzawa ", 13) == 0);
        CHECK(strstr(text, i < CLIENT_COMMANDS ? CLIENT_PAGES[i].name : "Commands:") != NULL);
        free(text);
    }
}

/* -------------------------------------------------------------------- tags */

static char *with_tags(const char *body, const char *tag1, const char *tag2)
{
    const char *tags[2] = {tag1, tag2};
    client_buffer in = {0}, out;
    CHECK(client_buffer_append(&in, body, strlen(body)));
    CHECK(client_tags_add(&out, &in, tags, !tag1 ? 0 : tag2 ? 2 : 1));
    free(in.data);
    return out.data;
}

TEST(tags_are_added)
{
    static const char *const CASES[][2] = {
        {"{\"a\": 1}", "{\"tags\":[\"x\",\"y\"],\"a\": 1}"},
        {"{}", "{\"tags\":[\"x\",\"y\"]}"},
        {" {\n}", " {\"tags\":[\"x\",\"y\"]\n}"},
        {"{\"tags\": []}", "{\"tags\": [\"x\",\"y\"]}"},
        {"{\"tags\": [\"x\"], \"b\": 2}", "{\"tags\": [\"x\",\"y\"], \"b\": 2}"},
        {"{\"tags\": [\n\"z\"\n]}", "{\"tags\": [\"z\",\"x\",\"y\"]\n\n}"},
        {"{\"p\": {\"tags\": [1]}, \"q\": \"\\\"tags\\\": }\", \"tags\": [\"q\"]}",
         "{\"p\": {\"tags\": [1]}, \"q\": \"\\\"tags\\\": }\", \"tags\": [\"q\",\"x\",\"y\"]}"},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        char *got = with_tags(CASES[i][0], "x", "y");
        CHECK_STR(got, CASES[i][1]);
        free(got);
    }
}

/* What is no object, or has tags that are no array, goes to the server as it is. */
TEST(tags_leave_what_they_do_not_understand)
{
    static const char *const CASES[] = {
        "",        "[1]",           "{",        "{\"a\"", "{\"a\":", "{\"tags\": 3}", "{\"tags\": [1}", "{\"a\\",
        "{\"tags", "{\"a\": [1, 2", "nonsense", "\"",     "{1}",     "{\"tags\":"};
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        char *got = with_tags(CASES[i], "x", NULL);
        CHECK_STR(got, CASES[i]);
        free(got);
    }
    char *same = with_tags("{\"a\": 1}", NULL, NULL);
    CHECK_STR(same, "{\"a\": 1}");
    free(same);
}

/* Every beginning of a request, copied to a block of just that size: a reader past the end is found by the sanitizer.
 */
TEST(tags_stay_inside_a_body_that_was_cut)
{
    static const char BODY[] = "{\"a\\\"\": [1, {\"b\": \"}\\\\\"}], \"tags\" : [\"z\", \"\\u0061\"] , \"c\": null}";
    const char *tags[] = {"x"};
    for (size_t len = 0; len < sizeof BODY; len++) {
        client_buffer in = {.data = malloc(len ? len : 1), .len = len}, out;
        memcpy(in.data, BODY, len);
        CHECK(client_tags_add(&out, &in, tags, 1));
        CHECK(out.data != NULL);
        free(in.data);
        free(out.data);
    }
}

TEST(tags_that_are_not_utf8_are_refused)
{
    const char *bad[] = {"\xff"};
    client_buffer in = {0}, out;
    CHECK(client_buffer_append(&in, "{}", 2));
    CHECK(!client_tags_add(&out, &in, bad, 1));
    CHECK(out.data == NULL);
    free(in.data);
}

/* ------------------------------------------------------------------- files */

TEST(files_are_written_whole)
{
    char folder[] = "/tmp/test_client_XXXXXX", path[64], missing[96], message[256] = "";
    CHECK(mkdtemp(folder) != NULL);
    snprintf(path, sizeof path, "%s/out", folder);
    snprintf(missing, sizeof missing, "%s/none/out", folder);
    CHECK(client_file_write(path, "old and long", 12, message, sizeof message));
    CHECK(client_file_write(path, "new", 3, message, sizeof message));
    client_buffer back;
    CHECK(client_file_read(&back, path, message, sizeof message));
    CHECK_INT(back.len, 3);
    CHECK_STR(back.data, "new");
    free(back.data);
    CHECK(!client_file_write(missing, "x", 1, message, sizeof message));
    CHECK(strstr(message, "cannot write") != NULL);
    CHECK(!client_file_read(&back, missing, message, sizeof message));
    CHECK(back.data == NULL);
    CHECK(!client_file_read(&back, folder, message, sizeof message));
    CHECK(client_file_write("/dev/null", "x", 1, message, sizeof message));
    unlink(path);
    CHECK(rmdir(folder) == 0); /* nothing half-written was left behind */
}

static char *safe(const char *text)
{
    char *out = NULL;
    size_t len = 0;
    FILE *memory = open_memstream(&out, &len);
    client_print_safe(memory, text);
    fclose(memory);
    return out;
}

TEST(text_from_elsewhere_cannot_steer_the_terminal)
{
    char *got = safe("a\033[31m\x07\x7f\n\xc2\x9bZ \xc3\xa4");
    CHECK_STR(got, "a?[31m????Z \xc3\xa4");
    free(got);
    got = safe("\xe2\x80\xae"
               "gpj\xe2\x81\xa9\xd8\x9c\xe2\x80\xa8\xe2\x80\x94"); /* U+202E, U+2069, U+061C, U+2028, a dash */
    CHECK_STR(got, "?gpj???\xe2\x80\x94");
    free(got);
}

TEST(url_parts_are_escaped)
{
    client_buffer out = {0};
    CHECK(client_http_append_escaped(&out, "a/b?c=d&e #%\xc3\xa4~-._"));
    CHECK_STR(out.data, "a%2Fb%3Fc%3Dd%26e%20%23%25%C3%A4~-._");
    free(out.data);
}

TEST(server_url_is_checked)
{
    static const char *const BAD[] = {"",          "ftp://h", "127.0.0.1", "http://", "http://h?x=1", "http://h:99999",
                                      "http://a b"};
    char message[256];
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        client_http *http = client_http_open(BAD[i], NULL, NULL, message, sizeof message);
        CHECK_MSG(!http, "accepted \"%s\"", BAD[i]);
        client_http_close(http);
    }
    client_http *http = client_http_open("http://127.0.0.1:8080/", NULL, NULL, message, sizeof message);
    CHECK(http != NULL);
    client_http_close(http);
}
