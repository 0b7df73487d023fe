#include "codec/schema.h"
#include "harness.h"

#include <jansson.h>

/* tests/data/requests.json: {"name", "valid", "body", and for a refusal "code", "pointer", "says"}. The same list is
 * put to another implementation of JSON Schema by tests/api/test_schemas.py. */
static json_t *read_requests(void)
{
    json_error_t error;
    json_t *list = json_load_file("tests/data/requests.json", 0, &error);
    CHECK_MSG(json_is_array(list), "tests/data/requests.json: %s", error.text);
    return list;
}

static const char *text_of(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text ? text : "";
}

static void check_request(const schemas *all, const json_t *item)
{
    json_tree tree;
    problem_details problem;
    const char *name = text_of(item, "name");
    char *body = json_dumps(json_object_get(item, "body"), JSON_ENCODE_ANY);
    CHECK_MSG(json_scan(&tree, body, strlen(body), &problem), "%s: no JSON: %s", name, problem.detail);
    bool good = schemas_check(all, "request.json", tree.root, &problem);
    CHECK_MSG(good == json_is_true(json_object_get(item, "valid")), "%s: %s %s", name, good ? "taken" : "refused",
              problem.detail);
    if (!good) {
        CHECK_MSG(problem.status == 422, "%s: status %d", name, problem.status);
        CHECK_MSG(strcmp(problem.code, text_of(item, "code")) == 0, "%s: code %s: %s", name, problem.code,
                  problem.detail);
        CHECK_MSG(strcmp(problem.pointer, text_of(item, "pointer")) == 0, "%s: pointer %s: %s", name, problem.pointer,
                  problem.detail);
        CHECK_MSG(strstr(problem.detail, text_of(item, "says")), "%s: detail %s", name, problem.detail);
    }
    json_clear(&tree);
    free(body);
}

TEST(requests)
{
    char message[256] = "";
    size_t i;
    json_t *list = read_requests(), *item;
    schemas *all = schemas_load(NULL, 0, message, sizeof message);
    CHECK_MSG(all, "%s", message);
    json_array_foreach(list, i, item) if (all) check_request(all, item);
    CHECK(json_array_size(list) > 60);
    schemas_free(all);
    json_decref(list);
}

static schemas *parse(const char *schema, char message[256])
{
    const embedded_file file = {"s.json", schema, strlen(schema)};
    return schemas_load(&file, 1, message, 256);
}

/* Loads one file with the given text; true if it is taken. */
static bool takes(const char *schema, char message[256])
{
    schemas *all = parse(schema, message);
    schemas_free(all);
    return all != NULL;
}

TEST(what_is_not_checked_is_refused_at_loading)
{
    char message[256];
    CHECK(takes("{\"type\": \"object\", \"properties\": {\"a\": {\"type\": [\"number\", \"null\"]}}}", message));
    CHECK(!takes("{\"properties\": {\"a\": {\"pattern\": \"x\"}}}", message) && strstr(message, "\"pattern\""));
    CHECK(!takes("{\"items\": {\"$ref\": \"#/$defs/nowhere\"}}", message) && strstr(message, "#/$defs/nowhere"));
    CHECK(!takes("{\"$ref\": \"#\"}", message));
    CHECK(!takes("{\"$ref\": \"other.json\"}", message));
    CHECK(!takes("{\"type\": \"float\"}", message));
    CHECK(!takes("{\"uniqueItems\": true}", message));
    CHECK(!takes("{\"if\": 3}", message));
    CHECK(!takes("{\"oneOf\": [{\"type\": \"number\"}, {\"type\": \"integer\"}]}", message));
    CHECK(!takes("{\"oneOf\": [{\"type\": \"object\"}, {\"type\": \"object\"}]}", message));
    CHECK(!takes(
        "{\"anyOf\": [{\"type\": \"object\", \"required\": [\"k\"], \"properties\": {\"k\": {\"const\": \"a\"}}},"
        "{\"type\": \"object\", \"required\": [\"k\"], \"properties\": {\"k\": {\"const\": \"a\"}}}]}",
        message));
    CHECK(
        takes("{\"anyOf\": [{\"type\": \"object\", \"required\": [\"k\"], \"properties\": {\"k\": {\"const\": \"a\"}}},"
              "{\"type\": \"object\", \"required\": [\"k\"], \"properties\": {\"k\": {\"const\": \"b\"}}}]}",
              message));
}

/* Checks one text against one schema. */
static bool fits(const char *schema, const char *body, problem_details *problem)
{
    char message[256];
    json_tree tree;
    schemas *all = parse(schema, message);
    CHECK_MSG(all, "%s: %s", schema, message);
    CHECK(json_scan(&tree, body, strlen(body), problem));
    bool good = all && schemas_check(all, "s.json", tree.root, problem);
    json_clear(&tree);
    schemas_free(all);
    return good;
}

TEST(long_values)
{
    problem_details problem;
    char numbers[1024] = "[1", text[6000] = "\"";
    for (int i = 0; i < 99; i++)
        strcat(numbers, i == 70 ? ",-1" : ",2");
    strcat(numbers, "]");
    memset(text + 1, 'x', 5000);
    strcat(text, "\"");
    CHECK(fits("{\"type\": \"array\", \"minItems\": 100, \"maxItems\": 100, \"items\": {\"type\": \"number\"}}",
               numbers, &problem));
    CHECK(fits("{\"type\": \"array\", \"items\": {\"type\": \"integer\", \"minimum\": -1}}", numbers, &problem));
    CHECK(!fits("{\"type\": \"array\", \"items\": {\"type\": \"number\", \"minimum\": 0}}", numbers, &problem));
    CHECK_STR(problem.pointer, "/71");
    CHECK_STR(problem.code, "out_of_range");
    CHECK(!fits("{\"items\": {\"type\": \"string\"}}", numbers, &problem));
    CHECK_STR(problem.code, "wrong_type");
    CHECK(!fits("{\"type\": \"string\"}", numbers, &problem));
    CHECK(!fits("{\"type\": \"number\"}", numbers, &problem));
    CHECK(!fits("{\"maxItems\": 99}", numbers, &problem));
    CHECK(fits("{\"type\": \"string\", \"minLength\": 5000, \"maxLength\": 5000}", text, &problem));
    CHECK(!fits("{\"type\": \"string\", \"maxLength\": 4999}", text, &problem));
    CHECK(!fits("{\"type\": \"array\"}", text, &problem));
    CHECK(!fits("{\"enum\": [\"x\"]}", text, &problem));
    CHECK_STR(problem.code, "not_allowed");
}

TEST(lengths_count_characters)
{
    problem_details problem;
    CHECK(fits("{\"maxLength\": 3}", "\"\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\"", &problem));
    CHECK(!fits("{\"maxLength\": 2}", "\"\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\"", &problem));
    CHECK(fits("{\"minLength\": 3}", "\"a\\u0000b\"", &problem));
}

TEST(long_tables)
{
    problem_details problem;
    char rows[2048] = "[[1,2]";
    for (int i = 0; i < 99; i++)
        strcat(rows, i == 70 ? ",[2,-1]" : ",[1,2]");
    strcat(rows, "]");
    CHECK(fits("{\"type\": \"array\", \"minItems\": 100, \"maxItems\": 100,"
               " \"items\": {\"type\": \"array\", \"minItems\": 2, \"items\": {\"type\": \"number\"}}}",
               rows, &problem));
    CHECK(!fits("{\"items\": {\"items\": {\"type\": \"number\", \"minimum\": 0}}}", rows, &problem));
    CHECK_STR(problem.pointer, "/71/1");
    CHECK_STR(problem.code, "out_of_range");
    CHECK(!fits("{\"items\": {\"maxItems\": 1}}", rows, &problem));
    CHECK_STR(problem.pointer, "/0");
    CHECK(!fits("{\"items\": {\"type\": \"number\"}}", rows, &problem));
    CHECK_STR(problem.code, "wrong_type");
    CHECK(!fits("{\"maxItems\": 99}", rows, &problem));
}
