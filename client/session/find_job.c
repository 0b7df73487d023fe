/* find_job.c: jobs by what a person types of their ids: the first or the last digits, or @last. */
#include "session/find_job.h"

#include "show/report.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ID_DIGITS = 32, LEAST_DIGITS = 4, PAGE_JOBS = 100, MOST_LOOKED_AT = 2000 };

static bool is_short(const char *word)
{
    const size_t len = strlen(word);
    return strcmp(word, "@last") == 0 ||
           (len >= LEAST_DIGITS && len < ID_DIGITS && strspn(word, "0123456789abcdef") == len);
}

/* "@last": the first that is listed. */
static bool fits(const char *id, const char *word)
{
    const size_t len = strlen(word);
    return *word == '@' || strncmp(id, word, len) == 0 || strcmp(id + ID_DIGITS - len, word) == 0;
}

/* Looks through the newest jobs; found: the id. */
static client_exit find(client_session *s, char found[33], const char *word)
{
    char message[200], cursor[256] = "";
    client_exit code = CLIENT_OK;
    int looked_at = 0;
    found[0] = '\0';
    do {
        client_buffer path = {0};
        char start[64];
        json_t *page = NULL;
        const json_t *job;
        size_t i;
        snprintf(start, sizeof start, "/v1/jobs?limit=%d", *word == '@' ? 1 : PAGE_JOBS);
        if (client_buffer_append(&path, start, strlen(start)) &&
            (!*cursor || (client_buffer_append(&path, "&cursor=", 8) && client_http_append_escaped(&path, cursor)))) {
            code = client_get_json(s, &page, path.data);
        } else {
            free(path.data);
            code = client_complain(s, CLIENT_LOCAL, "no memory");
        }
        json_array_foreach(json_object_get(page, "jobs"), i, job)
        {
            const char *id = client_json_text(job, "id");
            looked_at++;
            if (strlen(id) != ID_DIGITS || !fits(id, word))
                continue;
            if (*found && code == CLIENT_OK) {
                snprintf(message, sizeof message, "%.31s is of several jobs, %s and %s among them: give more of it",
                         word, found, id);
                code = client_complain(s, CLIENT_USAGE, message);
            }
            memcpy(found, id, ID_DIGITS + 1);
        }
        snprintf(cursor, sizeof cursor, "%s", client_json_text(page, "next"));
        json_decref(page);
    } while (code == CLIENT_OK && *cursor && *word != '@' && looked_at < MOST_LOOKED_AT);
    if (code != CLIENT_OK || *found)
        return code;
    if (*word == '@')
        return client_complain(s, CLIENT_REFUSED, "there is no job yet");
    snprintf(message, sizeof message, "no id of the newest %d jobs begins or ends with %.31s", looked_at, word);
    return client_complain(s, CLIENT_REFUSED, message);
}

client_exit client_find_jobs(client_session *s, client_options *options, client_found_jobs *room)
{
    const char **words[CLIENT_FOUND_JOBS];
    int count = 0;
    const char *operand = CLIENT_PAGES[options->command].operand;
    if (operand && strcmp(operand, "ID") == 0)
        words[count++] = &options->operand;
    words[count++] = &options->baseline;
    for (int i = 0; i < options->with.count; i++)
        words[count++] = &options->with.item[i];
    client_exit code = CLIENT_OK;
    for (int i = 0; i < count && code == CLIENT_OK; i++) {
        if (!*words[i] || !is_short(*words[i]))
            continue;
        code = find(s, room->id[i], *words[i]);
        *words[i] = room->id[i];
    }
    return code;
}
