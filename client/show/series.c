#include "show/series.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const NAMES[CLIENT_COLUMNS] = {"iteration", "error_bound", "residual_total", "restart"};

void client_series_clear(client_series *series)
{
    for (int i = 0; i < CLIENT_COLUMNS; i++)
        free(series->column[i]);
    *series = (client_series){0};
}

static const char *next_line(const char *line)
{
    line += strcspn(line, "\r\n");
    return line + strspn(line, "\r\n");
}

/* The place of `name` in the header line, -1 if it is not there. */
static int find_column(const char *header, const char *name)
{
    size_t len = strlen(name);
    for (int place = 0;; place++) {
        size_t cell = strcspn(header, ",\r\n");
        if (cell == len && memcmp(header, name, len) == 0)
            return place;
        if (header[cell] != ',')
            return -1;
        header += cell + 1;
    }
}

/* The number in the cell `place` of a line, NaN where there is none. */
static double cell_value(const char *line, int place)
{
    for (; place > 0; place--) {
        line += strcspn(line, ",\r\n");
        if (*line != ',')
            return NAN;
        line++;
    }
    if (strncmp(line, "true", 4) == 0)
        return 1;
    char *end;
    double value = strtod(line, &end);
    return end == line || !strchr(",\r\n", *end) ? NAN : value;
}

bool client_series_read(client_series *out, const char *csv, char *message, size_t size)
{
    int place[CLIENT_COLUMNS];
    client_series series = {0};
    *out = series;
    for (int i = 0; i < CLIENT_COLUMNS; i++) {
        place[i] = find_column(csv, NAMES[i]);
        if (place[i] < 0) {
            snprintf(message, size, "the history has no column \"%s\"", NAMES[i]);
            return false;
        }
    }
    const char *line = next_line(csv);
    size_t lines = 1;
    for (const char *at = line; *at; at = next_line(at))
        lines++;
    for (int i = 0; i < CLIENT_COLUMNS; i++) {
        series.column[i] = calloc(lines, sizeof(double));
        if (!series.column[i]) {
            snprintf(message, size, "no memory");
            client_series_clear(&series);
            return false;
        }
    }
    for (; *line; line = next_line(line), series.count++)
        for (int i = 0; i < CLIENT_COLUMNS; i++)
            series.column[i][series.count] = cell_value(line, place[i]);
    *out = series;
    return true;
}
