/* uzawa: the command line client of the contact solver service. It speaks HTTP and nothing else. */
#include "commands/run.h"
#include "local/contexts.h"
#include "request/build.h"
#include "session/find_job.h"
#include "text/streams.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* For jansson, which takes a text for another when it cannot save all of it (lex_save of its 2.14 does not look): what
 * is sent must never depend on how much memory there was. */
static void *allocate_or_end(size_t size)
{
    void *block = malloc(size);
    if (block)
        return block;
    static const char MESSAGE[] = "uzawa: no memory\n";
    if (write(STDERR_FILENO, MESSAGE, sizeof MESSAGE - 1) > 0)
        fsync(STDERR_FILENO);
    _exit(CLIENT_LOCAL);
}

typedef client_exit (*command_run)(client_session *);

static const command_run RUN[CLIENT_COMMANDS] = {
    [CLIENT_SUBMIT] = client_submit,      [CLIENT_STATUS] = client_status,   [CLIENT_WAIT] = client_wait,
    [CLIENT_RESULT] = client_result,      [CLIENT_HISTORY] = client_history, [CLIENT_LIST] = client_list,
    [CLIENT_CANCEL] = client_delete,      [CLIENT_REFINE] = client_refine,   [CLIENT_VERIFY] = client_verify,
    [CLIENT_UPLOAD] = client_upload,      [CLIENT_PICTURE] = client_picture, [CLIENT_PLOT] = client_plot,
    [CLIENT_DELETE] = client_delete,      [CLIENT_FACTORS] = client_factors, [CLIENT_NODES] = client_nodes,
    [CLIENT_DOCTOR] = client_doctor,      [CLIENT_MCP] = client_mcp,         [CLIENT_REPORT] = client_report,
    [CLIENT_REQUEST] = client_request_of, [CLIENT_IMPORT] = client_import,   [CLIENT_PATH] = client_path,
};

/* options: as far as they were understood; command HELP where none was named. */
static client_exit complain_usage(const char *message, const client_options *options)
{
    const client_command command = options->command;
    const client_page *page = &CLIENT_PAGES[command];
    client_session session = {.options = options, .out = stdout, .err = stderr};
    if (options->json)
        return client_complain(&session, CLIENT_USAGE, message);
    fprintf(stderr, "uzawa: %s\n", message);
    if (command == CLIENT_HELP)
        fputs("usage: uzawa [--server URL] [--timeout S] COMMAND ...; see: uzawa help\n", stderr);
    else
        fprintf(stderr, "usage: uzawa %s; see: uzawa help %s\n", page->usage, page->name);
    return CLIENT_USAGE;
}

/* The service: what the command line says, else what the context that it or the
 * environment names has, else the rest of the environment, else the context that the file itself chooses. */
static bool choose_service(client_options *options, client_context *context, char *message, size_t size)
{
    const char *env = getenv("UZAWA_SERVER");
    const bool said = options->server != env && options->server != CLIENT_DEFAULT_SERVER;
    const char *name = options->context ? options->context : getenv("UZAWA_CONTEXT");
    name = name && *name ? name : NULL;
    memset(context, 0, sizeof *context);
    if (options->context && said)
        return snprintf(message, size, "--context and --server both name the service: choose one") < 0;
    if (!said && (name || !env || !*env) && !client_context_find(context, name, message, size))
        return false;
    if (context->server[0])
        options->server = context->server;
    return true;
}

static client_exit run_command(client_options *options)
{
    char message[512];
    if (options->version || options->command == CLIENT_VERSION) {
        puts(options->json ? "{\"version\": \"" CLIENT_VERSION_TEXT "\"}" : "uzawa " CLIENT_VERSION_TEXT);
        return CLIENT_OK;
    }
    if (options->help || options->command == CLIENT_HELP) {
        client_command topic = options->command;
        const char *format = options->json ? "json" : options->format ? options->format : "text";
        if (strcmp(format, "json") == 0)
            return client_help_print_json(stdout) ? CLIENT_OK : CLIENT_LOCAL;
        if (strcmp(format, "man") == 0) {
            client_manual_print(stdout);
            return CLIENT_OK;
        }
        if (client_completion_print(stdout, format))
            return CLIENT_OK;
        if (topic == CLIENT_HELP && options->operand) {
            if (!client_command_find(&topic, options->operand))
                return complain_usage("there is no such command", options);
        } else if (topic == CLIENT_HELP)
            topic = CLIENT_COMMANDS;
        client_help_print(stdout, topic);
        return CLIENT_OK;
    }
    client_session session = {
        .options = options, .out = stdout, .err = stderr, .deadline = client_clock() + options->timeout_s};
    client_context context;
    if (!choose_service(options, &context, message, sizeof message))
        return complain_usage(message, options);
    const bool named = context.server[0] != '\0'; /* the token of the environment is not for that service */
    session.http = client_http_open(options->server, named ? context.token : getenv("UZAWA_TOKEN"),
                                    named ? context.ca : getenv("UZAWA_CA"), message, sizeof message);
    if (!session.http)
        return complain_usage(message, options);
    client_found_jobs found;
    client_exit code = client_find_jobs(&session, options, &found);
    if (code == CLIENT_OK)
        code = RUN[options->command](&session);
    client_suites_clear(&session.suites);
    client_http_close(session.http);
    return code;
}

int main(int argc, char **argv)
{
    char message[256];
    client_options options;
    uz_hold_standard_streams();
    json_set_alloc_funcs(allocate_or_end, free);
    if (!client_arguments_parse(&options, argc, argv, getenv("UZAWA_SERVER"), message, sizeof message))
        return (int)complain_usage(message, &options);
    client_exit code = run_command(&options);
    if (fflush(stdout) != 0 || ferror(stdout)) {
        if (code != CLIENT_LOCAL) /* which has been told */
            perror("uzawa: cannot write to standard output");
        return CLIENT_LOCAL;
    }
    return (int)code;
}
