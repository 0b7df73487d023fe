/* Whole decks of Abaqus and CalculiX: the scene that they become, each line that has no place in it, and refusals. */
#include "harness.h"
#include "uzawa.h"

#include <math.h>

#define NODES  "*NODE,NSET=ALLN\n1,0,0\n2,2,0\n3,2,1\n4,0,1\n11,0,1\n12,2,1\n13,2,3\n14,0,3\n99,7,7\n"
#define BODIES NODES "*ELEMENT,TYPE=CPE4,ELSET=LOW\n1,1,2,3,4\n*ELEMENT,TYPE=CPE4,ELSET=HIGH\n2,11,12,13,14\n"
#define STEEL  "*MATERIAL,NAME=EL\n*ELASTIC\n1000.,.25\n*DENSITY\n2.\n*EXPANSION,ZERO=20.\n1.e-3\n"
#define SECTIONS                                                                                                       \
    "*SOLID SECTION,ELSET=LOW,MATERIAL=el\n3.\n*MATERIAL,NAME=SOFT\n*ELASTIC\n500.,0.\n"                               \
    "*SOLID SECTION,ELSET=HIGH,MATERIAL=SOFT\n"
#define PAIR                                                                                                           \
    "*SURFACE,NAME=SL\n2,S1\n*SURFACE,NAME=MA\n1,S3\n*CONTACT PAIR,INTERACTION=I\nSL,MA\n*SURFACE "                    \
    "INTERACTION,NAME=I\n"
#define MODEL BODIES STEEL SECTIONS PAIR

static uz_status read_deck(uz_deck *deck, const char *text, bool leave_out, uz_error *err)
{
    *err = (uz_error){0};
    return uz_deck_read(deck, text, strlen(text), 0, leave_out, err);
}

static void must_read(uz_deck *deck, const char *text)
{
    uz_error err;
    CHECK_MSG(read_deck(deck, text, false, &err) == UZ_OK, "line %lld: %s", (long long)err.line, err.message);
}

static const uz_given_group *group_named(const uz_scene *scene, const char *name)
{
    for (int64_t i = 0; i < scene->given.n_groups; i++)
        if (strcmp(scene->given.groups[i].name, name) == 0)
            return &scene->given.groups[i];
    CHECK_MSG(false, "no group %s", name);
    static const uz_given_group none;
    return &none;
}

TEST(a_deck_as_a_scene)
{
    uz_deck deck;
    must_read(&deck, MODEL "*NSET,NSET=FEET\n1,2\n"
                           "*INITIAL CONDITIONS,TYPE=TEMPERATURE\nALLN,20.\n"
                           "*AMPLITUDE,NAME=RISE\n0.,0.,2.,4.\n"
                           "*STEP,NLGEOM\n*STATIC\n.1,1.\n"
                           "*BOUNDARY\nFEET,2\n1,1,1\n11,1,1\n*BOUNDARY,AMPLITUDE=RISE\n14,1,1,.5\n"
                           "*CLOAD\n13,2,-3.\n13,2,-1.\n14,2,-4.\n"
                           "*DLOAD\n2,P3,7.\n2,P2,5.\nLOW,GRAV,9.,0.,-2.,0.\nHIGH,BX,1.5\n"
                           "*DSLOAD\nSL,P,2.\n*TEMPERATURE\n1,70.\n2,70.\n3,70.\n4,70.\n"
                           "*NODE PRINT,NSET=ALLN\nU\n*END STEP\n");
    const uz_scene *s = &deck.scene;
    CHECK(s->model == UZ_PLANE_STRAIN && s->thickness == 3.0 && s->formulation == UZ_FORMULATION_BBAR);
    CHECK(s->given.n_nodes == 8 && s->given.n_elements == 2 && !s->given.from_file); /* node 99 has no element */
    CHECK(deck.node_number[4] == 11 && deck.node_number[7] == 14 && s->given.xyz[2 * 7 + 1] == 3.0);
    CHECK_INT(group_named(s, "ALLN")->n_nodes, 8);
    CHECK(s->n_materials == 2 && strcmp(s->materials[0].on, "LOW") == 0 && s->materials[0].young == 1000.0 &&
          s->materials[0].density == 2.0 && s->materials[0].expansion == 1e-3 && s->materials[1].young == 500.0);
    /* node 1: x and y; nodes 2: y; node 11: x; node 14: x by half of the amplitude at time 1, which is 2 */
    CHECK_INT(s->n_supports, 4);
    double sum[2] = {0, 0};
    for (int64_t i = 0; i < s->n_supports; i++)
        for (int c = 0; c < 2; c++)
            sum[c] += isnan(s->supports[i].u[c]) ? 100 : s->supports[i].u[c];
    CHECK(sum[0] == 101.0);
    CHECK(sum[1] == 200.0);
    /* both nodes have the same force, as lines of one step add up: one group, and the sum */
    CHECK_INT(s->n_loads, 7);
    CHECK(s->loads[0].kind == UZ_LOAD_FORCE && s->loads[0].v[1] == -8.0 &&
          group_named(s, s->loads[0].on)->n_nodes == 2);
    CHECK(s->loads[1].kind == UZ_LOAD_PRESSURE && strcmp(s->loads[1].on, "SL") == 0 && s->loads[1].value == 2.0);
    CHECK(s->loads[2].value == 5.0 && s->loads[3].value == 7.0 && group_named(s, s->loads[3].on)->n_faces == 1);
    CHECK(group_named(s, s->loads[3].on)->face_node[0] == 6 && group_named(s, s->loads[3].on)->face_node[1] == 7);
    CHECK(s->loads[4].kind == UZ_LOAD_GRAVITY && s->loads[4].v[1] == -9.0 && strcmp(s->loads[4].on, "LOW") == 0);
    CHECK(s->loads[5].kind == UZ_LOAD_BODY_FORCE && s->loads[5].v[0] == 1.5);
    CHECK(s->loads[6].kind == UZ_LOAD_TEMPERATURE && s->loads[6].value == 50.0 && strcmp(s->loads[6].on, "LOW") == 0);
    CHECK(s->n_contacts == 1 && strcmp(s->contacts[0].on, "SL") == 0 && strcmp(s->contacts[0].with, "MA") == 0);
    CHECK_INT(deck.n_notes, 2);
    CHECK(deck.notes[0].effect == UZ_DECK_REPLACED && strstr(deck.notes[0].text, "NLGEOM"));
    CHECK(deck.notes[1].effect == UZ_DECK_IRRELEVANT && strcmp(deck.notes[1].keyword, "*NODE PRINT") == 0);
    uz_deck_clear(&deck);
}

/* The upper body turned about a node that no element has; the lower one held at one of its own, whose rotation is 6. */
TEST(rigid_bodies)
{
    uz_deck deck;
    must_read(&deck, MODEL "*NODE\n98,1,4\n97,0,0\n*NSET,NSET=LID\n13,14\n*RIGIDBODY,NSET=LID,REF NODE=98,ROTNODE=97\n"
                           "*RIGID BODY,ELSET=LOW,REF NODE=1\n*STEP\n*STATIC\n*BOUNDARY\n98,1,2,.5\n97,3,3,.1\n"
                           "1,1,2\n*CLOAD\n98,1,7.\n97,3,9.\n1,6,2.\n*ENDSTEP\n");
    const uz_scene *s = &deck.scene;
    CHECK(s->n_supports == 2 && s->n_loads == 2);
    const uz_support *lid = &s->supports[0], *low = &s->supports[1];
    CHECK(lid->kind == UZ_SUPPORT_RIGID && strcmp(lid->on, "LID") == 0 && lid->about[0] == 1.0 && lid->about[1] == 4.0);
    CHECK(lid->u[0] == 0.5 && lid->u[1] == 0.5 && lid->turn[2] == 0.1);
    CHECK(low->kind == UZ_SUPPORT_RIGID && group_named(s, low->on)->n_nodes == 4 && low->u[0] == 0.0);
    CHECK(isnan(low->turn[2]) && low->about[0] == 0.0);
    CHECK(s->loads[0].has_point && s->loads[0].point[1] == 4.0 && s->loads[0].v[0] == 7.0 &&
          s->loads[0].moment[2] == 9.0);
    CHECK(s->loads[1].moment[2] == 2.0 && s->loads[1].v[0] == 0.0);
    CHECK_INT(s->given.n_nodes, 8);
    CHECK_INT(deck.n_notes, 0);
    uz_deck_clear(&deck);
}

/* A surface that is given by its nodes is that of the sides between them; one node alone has none. */
TEST(surfaces_of_nodes)
{
    uz_deck deck;
    uz_error err;
    const char *head = BODIES STEEL SECTIONS "*SURFACE,NAME=MA\n1,S3\n";
    char text[2000];
    snprintf(text, sizeof text, "%s%s", head,
             "*SURFACE,NAME=SL,TYPE=NODE\n11\n12\n*CONTACT PAIR,INTERACTION=I\nSL,MA\n*STEP\n*STATIC\n*END STEP\n");
    must_read(&deck, text);
    CHECK(deck.scene.n_contacts == 1 && group_named(&deck.scene, deck.scene.contacts[0].on)->n_faces == 1);
    uz_deck_clear(&deck);
    snprintf(text, sizeof text, "%s%s", head,
             "*SURFACE,NAME=SL,TYPE=NODE\n12\n*CONTACT PAIR,INTERACTION=I\nSL,MA\n*STEP\n*STATIC\n*END STEP\n");
    CHECK(read_deck(&deck, text, false, &err) == UZ_ERR_UNSUPPORTED && strstr(err.message, "make no side"));
    CHECK(read_deck(&deck, text, true, &err) == UZ_OK && deck.scene.n_contacts == 0);
    uz_deck_clear(&deck);
}

#define STEP "*STEP\n*STATIC\n*END STEP\n"
/* What would change the answer: refused with its line, and told where it may be left out. lines of MODEL: 39 */
static const struct {
    const char *text;
    int64_t line; /* behind MODEL; 0: not asked */
    const char *says;
} LEFT[] = {
    {"*FRICTION\n.1\n" STEP, 1, "coefficient 0.1"},
    {"*EQUATION\n2\n1,1,1.,2,1,-1.\n" STEP, 1, "equations"},
    {"*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR\n2.e3\n" STEP, 1, "a spring of 2e+03"}, /* 1000 / (2000 * 2) */
    {"*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=EXPONENTIAL\n.1,50.\n" STEP, 1, "by about 0.22"},
    {"*PLASTIC\n1.,0.\n" STEP, 1, "no word for it"},
    {"*CONTACT PAIR,INTERACTION=I,ADJUST=.1\nSL,MA\n" STEP, 1, "ADJUST=.1"},
    {"*INITIAL CONDITIONS,TYPE=STRESS\n1,1,0.,0.\n" STEP, 1, "type STRESS"},
    {STEP "*STEP\n*FREQUENCY\n3\n*END STEP\n", 4, "second step"},
    {"*STEP\n*STATIC\n*DLOAD\nLOW,CENTRIF,1.,0.,0.,0.,0.,1.,0.\n*END STEP\n", 4, "CENTRIF"},
    {"*STEP\n*STATIC\n*CLOAD\n99,1,1.\n*END STEP\n", 0, "no element has"},
    {"*STEP\n*STATIC\n*CLOAD\n1,5,1.\n*END STEP\n", 4, "direction 5"},
    {"*STEP\n*STATIC\n*TEMPERATURE\n1,5.\n*END STEP\n", 0, "varies within 1 elements"},
    {"*STEP\n*STATIC\n*BOUNDARY,OP=NEW\n1,1\n*END STEP\n", 3, "OP=NEW"},
    {"*STEP\n*STATIC\n*BOUNDARY,USER\n1,1\n*END STEP\n", 3, "USER"},
};

static int64_t count_lines(const char *text)
{
    int64_t lines = 0;
    for (; *text; text++)
        lines += *text == '\n';
    return lines;
}

TEST(nothing_is_left_out_in_silence)
{
    for (size_t i = 0; i < sizeof LEFT / sizeof LEFT[0]; i++) {
        char text[2000];
        uz_deck deck;
        uz_error err;
        snprintf(text, sizeof text, MODEL "%s", LEFT[i].text);
        CHECK_MSG(read_deck(&deck, text, false, &err) == UZ_ERR_UNSUPPORTED && strstr(err.message, LEFT[i].says),
                  "%zu: %s", i, err.message);
        CHECK_MSG(LEFT[i].line == 0 || err.line == count_lines(MODEL) + LEFT[i].line, "%zu: line %lld", i,
                  (long long)err.line);
        CHECK(!deck.notes && !deck.scene.materials && !deck.node_number);
        CHECK_MSG(read_deck(&deck, text, true, &err) == UZ_OK, "%zu: %s", i, err.message);
        bool told = false;
        for (int64_t k = 0; k < deck.n_notes; k++)
            told = told || (deck.notes[k].effect == UZ_DECK_LEFT_OUT && strstr(deck.notes[k].text, LEFT[i].says));
        CHECK_MSG(told, "%zu", i);
        uz_deck_clear(&deck);
    }
}

/* By name, and by the behavior of a contact pair that comes before it. */
TEST(ties)
{
    uz_deck deck;
    must_read(&deck, BODIES STEEL SECTIONS "*SURFACE,NAME=SL\n2,S1\n*SURFACE,NAME=MA\n1,S3\n"
                                           "*TIE,NAME=T,POSITION TOLERANCE=0.25\nSL,MA\n" STEP);
    CHECK(deck.scene.n_contacts == 0 && deck.scene.n_ties == 1 && deck.n_notes == 0);
    CHECK(strcmp(deck.scene.ties[0].on, "SL") == 0 && strcmp(deck.scene.ties[0].to, "MA") == 0 &&
          deck.scene.ties[0].tolerance == 0.25);
    uz_deck_clear(&deck);
#define GLUED                                                                                                          \
    BODIES STEEL SECTIONS "*SURFACE,NAME=SL\n2,S1\n*SURFACE,NAME=MA\n1,S3\n*CONTACT PAIR,INTERACTION=glue\nSL,MA\n"    \
                          "*SURFACE INTERACTION,NAME=GLUE\n*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=TIED\n1.e7\n"
    must_read(&deck, GLUED "*FRICTION\n1.e30,1.e7\n" STEP);
    CHECK(deck.scene.n_contacts == 0 && deck.scene.n_ties == 1 && deck.scene.ties[0].tolerance == 0.0);
    CHECK(deck.n_notes == 2 && deck.notes[1].effect == UZ_DECK_REPLACED && deck.notes[0].effect == UZ_DECK_REPLACED &&
          strstr(deck.notes[0].text, "a tie in place of a spring"));
    uz_deck_clear(&deck);
    uz_error err; /* soft along the surfaces */
    CHECK(read_deck(&deck, GLUED "*FRICTION\n1.e30,1.e3\n" STEP, false, &err) == UZ_ERR_UNSUPPORTED &&
          strstr(err.message, "a spring of 1e+03"));
}

/* As CalculiX takes them: a section before the material that it names. */
TEST(sections_before_their_materials)
{
    uz_deck deck;
    must_read(&deck, BODIES "*SOLID SECTION,ELSET=LOW,MATERIAL=EL\n*SOLID SECTION,ELSET=HIGH,MATERIAL=soft\n" STEEL
                            "*MATERIAL,NAME=SOFT\n*ELASTIC\n500.,0.\n" STEP);
    const uz_scene *s = &deck.scene;
    CHECK(s->n_materials == 2 && strcmp(s->materials[0].on, "LOW") == 0 && s->materials[0].young == 1000.0 &&
          s->materials[0].density == 2.0 && strcmp(s->materials[1].on, "HIGH") == 0 && s->materials[1].young == 500.0);
    uz_deck_clear(&deck);
}

static const struct {
    const char *text;
    const char *says;
} REFUSED[] = {
    {MODEL, "no *STEP with *STATIC"},
    {MODEL "*STEP\n*DYNAMIC\n1.,1.\n*END STEP\n", "*DYNAMIC"},
    {BODIES STEEL STEP, "no *SOLID SECTION"},
    {BODIES "*MATERIAL,NAME=EL\n*DENSITY\n1.\n" SECTIONS STEP, "has no *ELASTIC"},
    {BODIES "*MATERIAL,NAME=EL\n*ELASTIC,TYPE=ORTHO\n1.,1.\n" SECTIONS STEP, "TYPE=ORTHO"},
    {BODIES "*ELASTIC\n1.,0.\n" STEP, "before any *MATERIAL"},
    {BODIES "*SOLID SECTION,ELSET=LOW,MATERIAL=GONE\n" STEP, "no material \"GONE\""},
    {MODEL "*CONTACT PAIR,INTERACTION=I\nSL,GONE\n" STEP, "no surface \"GONE\""},
    {MODEL "*STEP\n*STATIC\n*BOUNDARY\nGONE,1\n*END STEP\n", "no set of nodes \"GONE\""},
    {MODEL "*STEP\n*STATIC\n*BOUNDARY\n77,1\n*END STEP\n", "node 77 is not there"},
    {MODEL "*STEP\n*STATIC\n*BOUNDARY,AMPLITUDE=GONE\n1,1\n*END STEP\n", "no amplitude"},
    {MODEL "*STEP\n*STATIC\n*CLOAD\n1,1,x\n*END STEP\n", "a force was expected"},
    {MODEL "*STEP\n*STATIC\n*DLOAD\n1,P5,1.\n*END STEP\n", "no side P5"},
    {MODEL "*STEP\n*STATIC\n*DSLOAD\nGONE,P,1.\n*END STEP\n", "no surface of sides"},
    {MODEL "*RIGID BODY,ANALYTICAL SURFACE=SL,REF NODE=99\n" STEP, "an NSET or an ELSET"},
    {MODEL "*RIGID BODY,NSET=ALLN,REF NODE=77\n" STEP, "node 77 is not there"},
    {MODEL "*RIGID BODY,NSET=ALLN,REF NODE=ALLN\n" STEP, "REF NODE is one node"},
    {NODES "*ELEMENT,TYPE=CAX4,ELSET=LOW\n1,1,2,3,4\n" STEEL "*SOLID SECTION,ELSET=LOW,MATERIAL=EL\n"
           "*RIGID BODY,ELSET=LOW,REF NODE=99\n*STEP\n*STATIC\n*BOUNDARY\n99,6,6,.1\n*END STEP\n",
     "along its axis only"},
    {MODEL "*INCLUDE,INPUT=more.inp\n" STEP, "*INCLUDE is not read"},
    {NODES
     "*ELEMENT,TYPE=CPE4,ELSET=LOW\n1,1,2,3,4\n*ELEMENT,TYPE=CAX4,ELSET=HIGH\n2,11,12,13,14\n" STEEL SECTIONS STEP,
     "of one kind"},
};

TEST(refusals)
{
    for (size_t i = 0; i < sizeof REFUSED / sizeof REFUSED[0]; i++) {
        uz_deck deck;
        uz_error err;
        CHECK_MSG(read_deck(&deck, REFUSED[i].text, true, &err) != UZ_OK && strstr(err.message, REFUSED[i].says),
                  "%zu: %s", i, err.message);
        CHECK(err.line > 0 && !deck.notes && !deck.scene.given.xyz);
        uz_deck_clear(&deck);
    }
}

/* Each node moved by another length: more supports than a scene may have. */
TEST(too_many_supports_are_refused)
{
    enum { COLUMNS = 600 };
    char *text = NULL;
    size_t len = 0;
    uz_deck deck;
    uz_error err;
    FILE *out = open_memstream(&text, &len);
    fputs("*NODE\n", out);
    for (int i = 0; i < COLUMNS; i++)
        fprintf(out, "%d,%d,0\n%d,%d,1\n", 2 * i + 1, i, 2 * i + 2, i);
    fputs("*ELEMENT,TYPE=CPE4,ELSET=LOW\n", out);
    for (int i = 0; i + 1 < COLUMNS; i++)
        fprintf(out, "%d,%d,%d,%d,%d\n", i + 1, 2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2);
    fputs(STEEL "*SOLID SECTION,ELSET=LOW,MATERIAL=EL\n*STEP\n*STATIC\n*BOUNDARY\n", out);
    for (int i = 0; i < 2 * COLUMNS; i++)
        fprintf(out, "%d,1,1,%d\n", i + 1, i);
    fputs("*END STEP\n", out);
    CHECK(fclose(out) == 0);
    CHECK_MSG(read_deck(&deck, text, true, &err) == UZ_ERR_UNSUPPORTED && strstr(err.message, "more than"), "%s",
              err.message);
    free(text);
}

/* Whatever is cut off, the rest is read or refused. */
TEST(every_beginning_of_a_deck)
{
    static const char whole[] = MODEL "*AMPLITUDE,NAME=A\n0.,0.,1.,1.\n*STEP\n*STATIC\n*BOUNDARY,AMPLITUDE=A\n1,1,2\n"
                                      "*DLOAD\n2,P3,7.\nLOW,GRAV,9.,0.,-2.,0.\n*CLOAD\n13,2,-3.\n*END STEP\n";
    for (size_t len = 0; len < sizeof whole; len++) {
        uz_deck deck;
        uz_error err = {0};
        char *part = malloc(len + 1);
        memcpy(part, whole, len);
        const uz_status status = uz_deck_read(&deck, part, len, 0, true, &err);
        CHECK_MSG(status == UZ_OK || ((status == UZ_ERR_FORMAT || status == UZ_ERR_UNSUPPORTED) && err.line > 0),
                  "%zu bytes: %s", len, uz_status_name(status));
        free(part);
        uz_deck_clear(&deck);
    }
}
