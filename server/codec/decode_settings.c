#include "codec/decode.h"

#include <string.h>

static const struct {
    const char *name;
    double relative_error; /* 0: rounding level */
    bool balanced;
} LEVELS[] = {{"quick", 1e-2, false}, {"balanced", 1e-2, true}, {"precise", 1e-8, false}, {"exact", 0, false}};

static void set_level(uz_settings *out, const char *name)
{
    for (size_t i = 0; i < sizeof LEVELS / sizeof LEVELS[0]; i++)
        if (strcmp(LEVELS[i].name, name) == 0) {
            out->relative_error = LEVELS[i].relative_error;
            out->balanced = LEVELS[i].balanced;
        }
}

static const char *text_or(const json_t *object, const char *key, const char *otherwise)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text ? text : otherwise;
}

static double number_or(const json_t *object, const char *key, double otherwise)
{
    const json_t *value = json_object_get(object, key);
    return value ? json_real_value(value) : otherwise;
}

/* The schema's enums and the library's names are the same words (a test compares them), so parsing cannot fail. */
void decode_settings(uz_settings *out, const json_t *object)
{
    uz_settings s = uz_settings_default();
    const json_t *accuracy = json_object_get(object, "accuracy");
    uz_method_parse(&s.method, text_or(object, "method", "auto"));
    uz_operator_parse(&s.op, text_or(object, "operator", "auto"));
    uz_ordering_parse(&s.ordering, text_or(object, "ordering", "auto"));
    uz_stopping_parse(&s.stopping, text_or(object, "stopping", "certified"));
    set_level(&s, s.stopping == UZ_STOP_PAPER ? "quick" : "precise");
    if (json_is_object(accuracy))
        s.relative_error = number_or(accuracy, "relative_error", s.relative_error);
    else if (accuracy)
        set_level(&s, json_string_value(accuracy));
    s.epsilon = number_or(object, "epsilon", 1e-6);
    s.alpha = number_or(object, "alpha", s.alpha);
    s.max_iterations = (int64_t)number_or(object, "max_iterations", (double)s.max_iterations);
    s.time_limit_s = number_or(object, "time_limit_s", s.time_limit_s);
    s.semidefinite = json_is_true(json_object_get(object, "semidefinite"));
    *out = s;
}
