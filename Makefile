# Builds the contact solver service. `make help` lists the targets.
.DEFAULT_GOAL := all
SHELL := /bin/bash
MAKEFLAGS += --no-builtin-rules

BUILD  ?= build
CC     ?= gcc
ifeq ($(origin CC),default)
CC     := gcc
endif
DEBUG  ?= -g
OPT    ?= -O2 $(DEBUG)
SAN    ?=
PREFIX ?= /usr/local
PYTHON ?= /usr/bin/python3

PACKAGES := gcc make pkg-config libmicrohttpd-dev libjansson-dev libsuitesparse-dev libsqlite3-dev \
            libopenblas-dev liblapacke-dev libcurl4-gnutls-dev libgnutls28-dev zlib1g-dev libdeflate-dev libexpat1-dev libpng-dev libgmp-dev \
            libpq-dev
TEST_PACKAGES := python3 python3-jsonschema python3-meshio curl jq openssl locales clang clang-format clang-tidy cppcheck libclang-rt-14-dev valgrind \
                 postgresql pgbouncer haproxy python3-yaml nodejs git mandoc librsvg2-bin gmsh libgmp-dev zsh fish

# The web page's bundler and libraries; the browser that tests it.
PACKAGES += esbuild libjs-three node-d3-scale node-d3-shape
TEST_PACKAGES += chromium chromium-driver python3-selenium python3-pil

# The Python package, and what builds its wheel; files of SciPy's.
TEST_PACKAGES += python3-numpy python3-scipy python3-pip python3-setuptools python3-wheel

# One body on many machines: uzawa-group is built where these are, and nothing else needs them.
GROUP_PACKAGES := libpetsc-real-dev openmpi-bin

PEER_PACKAGES := coinor-libipopt-dev coinor-libclp-dev python3-numpy python3-cvxopt octave python3-siconos python3-petsc4py \
                 calculix-ccx python3-getfem++

WARN := -Wall -Wextra -Wconversion -Wshadow -Werror
STD  := -std=c11 -D_GNU_SOURCE
INC  := -Isolver/include -Isolver -Iserver -Iclient -I$(BUILD)/gen

# Package flags are asked for once, when first needed, so that `make deps` works on a bare machine.
pkg = $(shell pkg-config $(1) 2>/dev/null)
SERVER_CFLAGS = $(call pkg,--cflags libmicrohttpd jansson sqlite3 libcurl gnutls libpq)
SOLVER_LIBS   = -lcholmod -lcamd -lopenblas -llapacke -lgomp -lsuitesparseconfig $(call pkg,--libs gnutls) -lgmp -lpng -ldeflate -lexpat -lz -lm
SERVER_LIBS   = $(call pkg,--libs libmicrohttpd sqlite3 libcurl libpq) $(SOLVER_LIBS) -lpthread
CLIENT_LIBS   = $(call pkg,--libs libcurl jansson gnutls) -lm
CFLAGS_ALL    = $(STD) $(OPT) $(WARN) $(SAN) -fno-omit-frame-pointer -pthread -MMD -MP $(INC) $(SERVER_CFLAGS) $(CFLAGS)
# The gold linker, where it is: binutils has it, and it links the test programs in an eighth of the time. Not with clang,
# whose sanitizer has symbols that gold warns of.
GOLD_OF_GCC   := $(if $(shell command -v ld.gold 2>/dev/null),-fuse-ld=gold)
GOLD           = $(if $(findstring clang,$(CC)),,$(GOLD_OF_GCC))
LDFLAGS_ALL   = $(SAN) -pthread $(GOLD) $(LDFLAGS)

SOLVER_SRC := $(sort $(wildcard solver/*/*.c))
VERSION    := $(shell sed -n 's/^\#define UZAWAD_VERSION "\(.*\)"/\1/p' server/options/options.h)
HAS_PETSC  := $(shell pkg-config --exists petsc ompi-c 2>/dev/null && echo yes)
GROUP_SRC  := $(sort $(wildcard solver/group/worker/*.c))
SERVER_SRC := $(sort $(wildcard server/*.c server/*/*.c server/*/*/*.c))
CLIENT_SRC := $(sort $(wildcard client/*.c client/*/*.c))
UNIT_SRC   := $(sort $(wildcard tests/unit/*/test_*.c tests/unit/*/*/test_*.c tests/unit/*/*/*/test_*.c))
FUZZ_SRC   := $(sort $(wildcard tests/fuzz/fuzz_*.c))
BENCH_SRC  := $(sort $(wildcard tests/bench/*.c))
EXTREMES_SRC := $(sort $(wildcard tests/extremes/*.c))
LARGE_SRC  := $(sort $(wildcard tests/extremes/large/*.c))
THEORY_SRC := $(sort $(wildcard tests/theory/*.c))
FIGURES_SRC := $(sort $(wildcard tests/figures/*.c))
SOAK_SRC   := $(sort $(wildcard tests/soak/*.c))
GUARD_SRC  := $(sort $(wildcard tests/guard/*.c))
PEERS_SRC  := $(sort $(wildcard tests/peers/*.c))
PRELOAD_SRC := $(sort $(wildcard tests/preload/*.c))
SCHEMAS    := $(sort $(wildcard schemas/*.json))
C_FILES    := $(SOLVER_SRC) $(if $(HAS_PETSC),$(GROUP_SRC)) $(SERVER_SRC) $(CLIENT_SRC) $(UNIT_SRC) $(FUZZ_SRC) $(BENCH_SRC) $(EXTREMES_SRC) $(LARGE_SRC) $(THEORY_SRC) $(FIGURES_SRC) $(SOAK_SRC) $(GUARD_SRC) $(PRELOAD_SRC) $(PEERS_SRC) \
              $(wildcard tests/support/*.c)
H_FILES    := $(if $(HAS_PETSC),$(wildcard solver/group/worker/*.h)) $(wildcard solver/*/*.h server/*.h server/*/*.h server/*/*/*.h client/*.h client/*/*.h tests/*/*.h)

PAGE_SRC   := $(sort $(wildcard client/page/*.* client/examples/gallery/*.json)) tests/data/paper_body.json

# The client's manual page and completions, which it has from its table of commands.
MANUAL     := $(addprefix $(BUILD)/uzawa.,1 bash zsh fish)

obj = $(patsubst %.c,$(BUILD)/obj/%.o,$(1))
# Builds with sanitizers, which have a BUILD of their own, take from the ordinary one what they need not look at. Under
# ThreadSanitizer that is the client, and rooms that know of no thread: they touch what their caller has given them.
PLAIN      ?= $(BUILD)
THREADS    := pthread|stdatomic|core/(aside|lock|reserve)\.h|linalg/pieces\.h
THREADLESS := $(if $(findstring thread,$(SAN)),client/ $(filter-out $(dir $(shell grep -lE '$(THREADS)' solver/*/*.[ch])),$(sort $(dir $(SOLVER_SRC)))))
looked_at   = $(foreach source,$(1),$(if $(filter $(addsuffix %,$(THREADLESS)),$(source)),$(PLAIN),$(BUILD))/obj/$(source:.c=.o))
SOLVER_OBJ := $(call looked_at,$(SOLVER_SRC))
SERVER_OBJ := $(call obj,$(SERVER_SRC)) $(BUILD)/obj/gen/embedded.o $(BUILD)/obj/gen/page.o
CLIENT_OBJ := $(call looked_at,$(CLIENT_SRC))
GROUP_OBJ  := $(call obj,$(GROUP_SRC))
# What unit tests may link: everything but the two mains.
PARTS_OBJ  := $(filter-out $(BUILD)/obj/server/main.o,$(SERVER_OBJ)) $(filter-out %/obj/client/main.o,$(CLIENT_OBJ))
UNIT_BIN   := $(addprefix $(BUILD)/tests/,$(notdir $(basename $(UNIT_SRC))))
PRELOADS   := $(patsubst tests/preload/%.c,$(BUILD)/%.so,$(PRELOAD_SRC))
FUZZ_BIN   := $(patsubst tests/fuzz/%.c,$(BUILD)/fuzz/%,$(FUZZ_SRC))

##@ Use
.PHONY: all wheel deb group deps-group demo gallery run guide install clean help deps deps-test
all: $(BUILD)/uzawad $(BUILD)/uzawa $(MANUAL) $(if $(HAS_PETSC),$(BUILD)/uzawa-group) ## build the daemon and the client, and uzawa-group where PETSc is

# After deps, which may have installed the compiler; said, since it takes a minute where nothing is built yet.
build_programs = @$(MAKE) --no-print-directory -q all 2>/dev/null || echo "building the daemon and the client"; \
                 $(MAKE) --no-print-directory -s -j$$(nproc) all

demo: deps ## install what is missing, build, start the daemon, solve the paper's body, show the answer
	$(build_programs)
	@tests/demo.sh $(BUILD)

gallery: deps ## solve the five scenes of the gallery: pictures and summaries in build/gallery; KEEP=1: pictures into client/examples too
	$(build_programs)
	@tests/gallery.sh $(BUILD) $(BUILD)/gallery $(if $(KEEP),--keep)
	@$(call measured,gallery) $(PYTHON) -B tests/figures/gallery.py $(BUILD)/gallery $(BUILD)/gallery.json

run: deps ## keep the daemon in the foreground on 127.0.0.1:8080 with ./contact.db
	$(build_programs)
	exec $(BUILD)/uzawad --listen 127.0.0.1:8080 --db ./contact.db

deps: ## install the Debian packages that are missing
	@tests/deps.sh $(PACKAGES)

deps-group: ## the same with what one body on many machines needs: PETSc and Open MPI
	@tests/deps.sh $(PACKAGES) $(GROUP_PACKAGES)

group: deps-group ## build uzawa-group, the program of the operator distributed
	@$(MAKE) --no-print-directory -s -j$$(nproc) $(BUILD)/uzawa-group

deps-test: ## the same with what only the tests use
	@tests/deps.sh $(PACKAGES) $(TEST_PACKAGES)

guide: ## renew docs/scenes.md, whose tables follow from schemas/request.json
	@$(PYTHON) -B tests/figures/scenes_page.py >$(BUILD)/scenes.md
	@mv $(BUILD)/scenes.md docs/scenes.md

wheel: ## build the wheel of the Python package in build/python (python3-pip, -setuptools, -wheel)
	@rm -rf $(BUILD)/python && mkdir -p $(BUILD)/python
	@cp -r client/python $(BUILD)/python/source
	@$(PYTHON) -m pip wheel -q --no-deps --no-build-isolation --no-cache-dir --disable-pip-version-check -w $(BUILD)/python $(BUILD)/python/source

install: all ## install both programs, the manual page and the completions under PREFIX
	install -D -m 755 $(BUILD)/uzawad $(DESTDIR)$(PREFIX)/bin/uzawad
	install -D -m 755 $(BUILD)/uzawa $(DESTDIR)$(PREFIX)/bin/uzawa
	$(if $(HAS_PETSC),install -D -m 755 $(BUILD)/uzawa-group $(DESTDIR)$(PREFIX)/bin/uzawa-group)
	install -D -m 644 $(BUILD)/uzawa.1 $(DESTDIR)$(PREFIX)/share/man/man1/uzawa.1
	install -D -m 644 $(BUILD)/uzawa.bash $(DESTDIR)$(PREFIX)/share/bash-completion/completions/uzawa
	install -D -m 644 $(BUILD)/uzawa.zsh $(DESTDIR)$(PREFIX)/share/zsh/vendor-completions/_uzawa
	install -D -m 644 $(BUILD)/uzawa.fish $(DESTDIR)$(PREFIX)/share/fish/vendor_completions.d/uzawa.fish

deb: all ## pack both programs, the unit of systemd and its configuration for Debian: build/uzawa_VERSION_ARCHITECTURE.deb
	@rm -rf $(BUILD)/deb
	@$(MAKE) --no-print-directory -s -o all HAS_PETSC= DESTDIR=$(BUILD)/deb/root PREFIX=/usr install
	@server/deploy/deb.sh $(BUILD) $(VERSION)

clean: ## remove everything built
	rm -rf build

help: ## this list
	@awk 'BEGIN{FS=":.*## "} /^##@/{printf "\n%s\n",substr($$0,5)} /^[a-z][a-z-]*:.*## /{printf "  %-14s %s\n",$$1,$$2}' Makefile

print-%:
	@echo '$($*)'

# ------------------------------------------------------------------ building

$(BUILD)/libuzawa.a: $(SOLVER_OBJ)
	@rm -f $@
	@ar rcs $@ $^

# An archive, so that a test program has only what it uses: the links of all are a fifth of a build with a sanitizer.
$(BUILD)/libparts.a: $(PARTS_OBJ)
	@rm -f $@
	@ar rcs $@ $^

$(BUILD)/uzawad: $(SERVER_OBJ) $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(SERVER_LIBS)

# Of the library it takes what both programs share (solver/text) and nothing that needs a library of the solver's.
$(BUILD)/uzawa: $(CLIENT_OBJ) $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(CLIENT_LIBS)

$(MANUAL): $(BUILD)/uzawa
	@$< help --format $(patsubst .%,%,$(patsubst .1,.man,$(suffix $@))) >$@.new && mv $@.new $@

# PETSc's macros for memory convert signed sizes in whoever uses them. It has a heap and handlers of its own, and runs
# under mpirun: no sanitizer, and what it has of the solver is that of the ordinary build.
GROUP_FLAGS = $(patsubst -I%,-isystem %,$(filter -I%,$(call pkg,--cflags petsc ompi-c))) -Wno-sign-conversion
$(GROUP_OBJ): CFLAGS += $(GROUP_FLAGS) -O3
$(GROUP_OBJ): override SAN =
$(BUILD)/uzawa-group: $(GROUP_OBJ) $(PLAIN)/libuzawa.a
	$(CC) $(GOLD) $(LDFLAGS) -o $@ $^ $(call pkg,--libs petsc ompi-c) $(SOLVER_LIBS) -lpthread

# Unit tests are a third of what is compiled, and run as fast without optimization: the time is the solver's. What the
# ordinary build has read, with every warning an error, need not be an error where a sanitizer's checks are amid the code:
# gcc warns of ways through them that nothing goes.
$(BUILD)/obj/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_ALL) $(if $(filter tests/%,$<),-Itests -Itests/support) $(if $(filter tests/unit/%,$<),-O0,$(if $(SAN),-Wno-error)) -c -o $@ $<

# Contraction only saves roundings there; the double-double arithmetic of certificates must never have it, which clang
# would give it within a statement.
CONTRACTED := solver/amg/blocks.c solver/amg/cycle.c solver/amg/galerkin.c solver/factor/blocked.c solver/factor/refill.c solver/factor/single.c solver/element/strain_lanes.c solver/assembly/stress_lanes.c solver/finite/finite_element.c solver/finite/turning.c $(wildcard solver/brick/*.c)
$(call obj,$(CONTRACTED)): CFLAGS += -ffp-contract=fast
$(call obj,$(wildcard solver/certificate/*.c)): CFLAGS += -ffp-contract=off
# Short loops of known length around the registers are unrolled.
UNROLLED := solver/amg/blocks.c solver/amg/cg.c solver/amg/cycle.c solver/amg/galerkin.c solver/amg/hold.c solver/amg/multigrid.c solver/amg/prolong.c solver/amg/rough.c solver/certificate/finite.c solver/factor/single.c solver/methods/exchange.c solver/assembly/stiffness.c solver/assembly/stress_lanes.c $(wildcard solver/bound/*.c solver/brick/*.c solver/element/*.c solver/finite/*.c solver/post/*.c) solver/io/vtu.c
# Where elements are, not with a sanitizer: its checks in every copy take a minute to compile, and tests gain less. Nor
# where a multigrid has a copy for each size of its blocks.
ROLLED = $(if $(SAN),$(addprefix $(BUILD)/obj/solver/,amg/blocks.o amg/cycle.o amg/galerkin.o element/% finite/% post/% assembly/stress_lanes.o))
$(call obj,$(UNROLLED)): CFLAGS += $(if $(filter $(ROLLED),$@),,-O3)
# Also those of lengths that only the run knows; without -O3, which contracts other products.
$(call obj,solver/factor/refill.c): CFLAGS += -funroll-loops

$(BUILD)/obj/gen/embedded.o: $(BUILD)/gen/embedded.c $(SCHEMAS) $(BUILD)/gen/openapi.json
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_ALL) -c -o $@ $<

# Read by the assembler as they stand.
$(call obj,server/store/postgresql/schema.c): $(wildcard server/store/postgresql/*.sql)

# The web page, bundled and put into the daemon.
$(BUILD)/obj/gen/page.o: $(BUILD)/gen/page.c
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_ALL) -c -o $@ $<
$(BUILD)/gen/page.c: $(PAGE_SRC)
	@mkdir -p $(@D)
	@client/page/bundle.sh $(BUILD)

# References of openapi.json are to files beside it; the service has it in one piece.
$(BUILD)/gen/openapi.json: schemas/bundle.awk $(SCHEMAS)
	@mkdir -p $(@D)
	@awk -f $< $(filter-out schemas/openapi.json,$(SCHEMAS)) schemas/openapi.json > $@

# Every schema file becomes bytes in the daemon, found by name (server/codec/embedded.h).
EMBEDDED = $(filter-out schemas/openapi.json,$(SCHEMAS)) $(BUILD)/gen/openapi.json
$(BUILD)/gen/embedded.c: $(SCHEMAS) Makefile
	@mkdir -p $(@D)
	@{ echo '#include "codec/embedded.h"'; \
	   n=0; for f in $(EMBEDDED); do n=$$((n+1)); \
	     echo "__asm__(\".section .rodata\\nembedded_$$n: .incbin \\\"$$f\\\"\\nembedded_$${n}_end: .byte 0\\n.text\");"; \
	     echo "extern const char embedded_$$n[], embedded_$${n}_end[];"; done; \
	   echo 'size_t embedded_count(void) { return '$$n'; }'; \
	   echo 'embedded_file embedded_at(size_t i) {'; \
	   n=0; for f in $(EMBEDDED); do n=$$((n+1)); \
	     echo "    if (i == $$((n-1))) return (embedded_file){\"$${f##*/}\", embedded_$$n, (size_t)(embedded_$${n}_end - embedded_$$n)};"; done; \
	   echo '    return (embedded_file){0, 0, 0};'; echo '}'; } > $@

# A test program stands in BUILD/tests by its name alone, wherever its source is.
unit_source = $(filter %/$(1).c,$(UNIT_SRC))
.SECONDEXPANSION:
$(UNIT_BIN): $(BUILD)/tests/%: $$(call obj,$$(call unit_source,$$*)) $(call obj,tests/support/harness.c tests/support/harness_files.c) $(BUILD)/libparts.a $(BUILD)/libuzawa.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS_ALL) $(if $(filter %alloc_failure,$@),-Wl$(comma)--wrap=malloc$(comma)--wrap=calloc$(comma)--wrap=realloc) $(if $(shell grep -lsE '__wrap_free|failing_heap' $(call unit_source,$*)),-Wl$(comma)--wrap=free) -o $@ $^ $(SERVER_LIBS) $(CLIENT_LIBS) -lquadmath -lgmp
comma := ,

# Ipopt is what obstacle problems are compared with, where it is installed; nothing else needs it.
$(call obj,tests/bench/ipopt.c): CFLAGS += $(patsubst -I%,-isystem %,$(call pkg,--cflags ipopt))
$(BUILD)/bench: $(call obj,$(BENCH_SRC)) $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(SOLVER_LIBS) $(call pkg,--libs ipopt) $(call pkg,--libs jansson libcurl) -lpthread

$(BUILD)/extremes: $(call obj,$(EXTREMES_SRC) tests/support/harness_measure.c) $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(SOLVER_LIBS) -lpthread -lquadmath -lgmp

# What claims of large deformation are held against: nothing of the solver.
$(BUILD)/large-checker: $(call obj,$(LARGE_SRC))
	$(CC) $(LDFLAGS_ALL) -o $@ $^ -lm

$(BUILD)/theory: $(call obj,$(THEORY_SRC) tests/support/harness_measure.c) $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(SOLVER_LIBS) -lpthread

# Counts back-substitutions by standing between the solver's parts (tests/figures/count.c).
FIGURES_WRAP := uz_factor_solve_one uz_factor_solve_lanes uz_principal_solve uz_multigrid_apply
$(BUILD)/figures: $(call obj,$(FIGURES_SRC) tests/support/harness_measure.c tests/support/harness_files.c) $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) $(patsubst %,-Wl$(comma)--wrap=%,$(FIGURES_WRAP)) -o $@ $^ $(SOLVER_LIBS) -lpthread -lquadmath

$(BUILD)/load: $(call obj,tests/soak/load.c)
	$(CC) $(LDFLAGS_ALL) -o $@ $^

$(BUILD)/library: $(call obj,tests/soak/library.c) $(PARTS_OBJ) $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(SERVER_LIBS) $(CLIENT_LIBS)

$(BUILD)/guard: $(call obj,$(GUARD_SRC)) $(BUILD)/libparts.a $(BUILD)/libuzawa.a
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(SERVER_LIBS) $(CLIENT_LIBS)

# What the comparison with other solvers is made with. Those need packages of their own: `make peers` installs them.
PEER_LAB := $(BUILD)/peers/lab
PEER_BIN := $(BUILD)/peers/ipopt $(BUILD)/peers/clp
$(call obj,tests/peers/ipopt.c): CFLAGS += $(patsubst -I%,-isystem %,$(call pkg,--cflags ipopt))
$(PEER_LAB): $(call obj,$(addprefix tests/peers/,lab.c problems.c condense.c peer.c files.c)) $(BUILD)/libuzawa.a
$(PEER_BIN): $(BUILD)/peers/%: $(BUILD)/obj/tests/peers/%.o $(call obj,tests/peers/peer.c tests/peers/files.c) $(BUILD)/libuzawa.a
$(BUILD)/peers/ipopt: PEER_LIBS = $(call pkg,--libs ipopt)
$(BUILD)/peers/clp: PEER_LIBS = $(call pkg,--libs clp)
$(PEER_LAB) $(PEER_BIN):
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS_ALL) -o $@ $^ $(SOLVER_LIBS) $(PEER_LIBS) -lpthread

# Stands before the heap of a whole daemon: never with a sanitizer, which has its own.
$(BUILD)/%.so: tests/preload/%.c
	@mkdir -p $(@D)
	$(CC) $(STD) $(OPT) $(WARN) -fPIC -shared -o $@ $< -ldl

.SECONDARY:

##@ Test
.PHONY: test test-unit test-api test-hygiene unit-bins asan ubsan tsan fuzz ci soak valgrind guard bench bench-compare \
        bench-size bench-solids bench-predictions bench-deps peers peers-contact peers-decks peers-large peers-large-solids peers-space extremes theory large roller arch trade figures numbers collect page-size
test: test-build ## build and pass every test; ONCE=1: those that make asan can't run, or not as well
	@tests/run.sh $(BUILD) "$(if $(ONCE),unit api browser guard)" "" "$(if $(ONCE),$(ONCE_ONLY))"

# What each of the targets that CI runs builds before its tests, so that tests/ci.sh can have it built meanwhile.
.PHONY: test-build test-postgresql-build asan-build tsan-build fuzz-build
test-build: deps-test
	@$(MAKE) --no-print-directory -s -j$$(nproc) all test-tools $(BUILD)/guard \
	    $(if $(ONCE),$(ONCE_UNIT),unit-bins)

guard: deps-test ## instructions of small problems against those kept in tests/data/guard.json; KEEP=1: keep the new ones
	@$(MAKE) --no-print-directory -s -j$$(nproc) $(BUILD)/guard
	@$(PYTHON) -B tests/guard/guard.py $(BUILD) $(if $(KEEP),--keep)

# What tests run besides both programs.
.PHONY: test-tools
test-tools: $(PRELOADS) $(BUILD)/library $(BUILD)/load $(BUILD)/large-checker $(PEER_LAB)

unit-bins: $(UNIT_BIN) test-tools

test-unit: all unit-bins ## the C tests only; FILTER=name runs some
	@tests/run.sh $(BUILD) unit $(FILTER)

test-api: all test-tools ## the tests that drive the real daemon and client; FILTER=name runs some
	@tests/run.sh $(BUILD) api $(FILTER)

.PHONY: test-postgresql
# In its short form some of them; test_daemons, test_database and the tests of the store are on it anyway.
ON_POSTGRESQL ?= test_assert test_between test_client test_refine
test-postgresql: test-postgresql-build ## tests of the daemon whose jobs are in PostgreSQL; ALL=1: all of them; FILTER=name runs some
	@UZAWA_STORE=postgresql tests/run.sh $(BUILD) api "$(FILTER)" "$(if $(ALL)$(FILTER),,$(ON_POSTGRESQL))"

test-postgresql-build: deps-test
	@$(MAKE) --no-print-directory -s -j$$(nproc) all test-tools

.PHONY: test-group
test-group: deps-test deps-group ## tests of one body on several processes, which skip what needs PETSc where it is not
	@$(MAKE) --no-print-directory -s -j$$(nproc) all $(BUILD)/tests/test_group $(BUILD)/tests/test_spread
	@tests/run.sh $(BUILD) "unit api" "" "test_group test_spread"

.PHONY: test-browser screenshots
test-browser: deps-test ## the web page in headless Chromium; FILTER=name runs some
	@$(MAKE) --no-print-directory -s -j$$(nproc) all
	@tests/run.sh $(BUILD) browser $(FILTER)

screenshots: deps-test ## the pictures of the web page in docs, from the running page, into client/page/screenshots
	@$(MAKE) --no-print-directory -s -j$$(nproc) all
	@$(PYTHON) -B tests/browser/screenshots.py $(BUILD) client/page/screenshots

.PHONY: test-image
test-image: ## build server/Containerfile and solve in it (buildah; mmdebstrap where no registry can be reached): minutes
	@mkdir -p $(BUILD) && tests/image.sh $(BUILD)

test-hygiene: ## formatting, static analysis, both compilers
	@tests/run.sh $(BUILD) hygiene

# Each sanitizer has a build of its own inside BUILD. Its reports need lines and no variables: with -g1 it compiles in
# three quarters of the time. Programs at a fixed address need not relocate the half a million pointers of what is
# checked whenever one starts, and tests start them some thousand times.
sanitized = @$(MAKE) --no-print-directory -s -j$$(nproc) $(BUILD)/libuzawa.a $(BUILD)/uzawa && \
            $(MAKE) --no-print-directory -s -j$$(nproc) BUILD=$(BUILD)/$(1) PLAIN=$(BUILD) OPT="-O1 -g1 -fno-pie" LDFLAGS=-no-pie SAN="$(2)"
# Where threads are: the C tests of the server's parts and the tests of the daemon, but for those that say
# "not under ThreadSanitizer", or "not under sanitizers" at all. Of those some say "for ThreadSanitizer, PART: REASON".
without_tsan = $(shell grep -L 'not under \(ThreadSanitizer\|sanitizers\)' $(1))
TSAN_UNIT = $(notdir $(basename $(call without_tsan,$(shell grep -lE 'pthread_create|include "(http|base/log|store|work|core/aside)' $(UNIT_SRC)))))
TSAN_API  = $(notdir $(basename $(call without_tsan,$(wildcard tests/api/test_*.py))))
TSAN_PARTS = $(call marked,for ThreadSanitizer,$(wildcard tests/api/test_*.py))
ASAN_API  = $(shell grep -L 'not under sanitizers' tests/api/test_*.py)
# In CI each test runs once, there, but for those that it is not made for. In the ordinary build besides: C tests of rooms
# whose sources the optimizer gets with flags of their own, and what says "in the ordinary build too: REASON" ("too, PART:
# REASON" of some of its tests), since too little of it can be done under a sanitizer.
TUNED_ROOMS = $(sort $(patsubst solver/%/,tests/unit/solver/%/%,$(dir $(CONTRACTED) $(UNROLLED))))
TUNED_UNIT  = $(filter $(TUNED_ROOMS),$(UNIT_SRC))
PLAIN_TOO   = $(call marked,in the ordinary build too,$(UNIT_SRC) $(ASAN_API))
ONCE_ONLY   = $(call programs,$(TUNED_UNIT) $(filter-out $(ASAN_API),$(wildcard tests/browser/test_*.py tests/api/test_*.py))) $(PLAIN_TOO)
# The C tests among them are all that is to be built.
ONCE_UNIT   = $(sort $(foreach one,$(filter unit/%,$(ONCE_ONLY)),$(BUILD)/tests/$(basename $(notdir $(one)))))
# What says "PHRASE: REASON", or "PHRASE, PART: REASON" of some of its tests; and all of what is given: KIND/NAME.PART or
# KIND/NAME, as tests/run.sh names them.
marked = $(shell grep -oE '$(1)(, [a-z_]+)?:' $(2) | \
           sed -E 's|^tests/([a-z]+)/(.*/)?(test_[a-z0-9_]+)\.[^,]*,? ?([a-z_]*).*|\1/\3.\4|; s|[.]$$||')
programs = $(foreach test,$(1),$(word 2,$(subst /, ,$(test)))/$(notdir $(basename $(test))))

asan: asan-build ## every test under AddressSanitizer and UndefinedBehaviorSanitizer
	@tests/run.sh $(BUILD)/asan "unit api" "$(FILTER)" "$(call programs,$(UNIT_SRC) $(ASAN_API))"

# A pointer that has left its object is found where it is used, by AddressSanitizer: the checks of each sum of pointers and
# of each size of an object, which take a quarter of the time to compile, are left to make ubsan.
asan-build: deps-test
	$(call sanitized,asan,-fsanitize=address$(comma)undefined -fno-sanitize=pointer-overflow$(comma)object-size -fno-sanitize-recover=all) all unit-bins

ubsan: deps-test ## the C tests under UndefinedBehaviorSanitizer alone
	$(call sanitized,ubsan,-fsanitize=undefined -fno-sanitize-recover=all) all unit-bins
	@tests/run.sh $(BUILD)/ubsan unit "$(FILTER)"

tsan: tsan-build ## the server's tests under ThreadSanitizer
	@tests/run.sh $(BUILD)/tsan "unit api" "$(FILTER)" "$(TSAN_UNIT:%=unit/%) $(TSAN_API:%=api/%) $(TSAN_PARTS)"

tsan-build: deps-test
	$(call sanitized,tsan,-fsanitize=thread) all $(TSAN_UNIT:%=$(BUILD)/tsan/tests/%)

soak: deps-test ## a long life in an hour: kills, power losses, slow clients, a million jobs; a table; FILTER=name runs some
	@$(MAKE) --no-print-directory -s -j$$(nproc) all $(BUILD)/tests/test_store_faults $(BUILD)/load $(BUILD)/library $(PRELOADS)
	@$(PYTHON) -B tests/soak/soak.py $(BUILD) "$(FILTER)"

valgrind: deps-test ## the C tests under valgrind, VALGRIND_SECONDS (default 60) each; FILTER=name runs some
	@tests/deps.sh valgrind
	@$(MAKE) --no-print-directory -s -j$$(nproc) unit-bins
	@tests/valgrind.sh $(BUILD) $(FILTER)

fuzz: fuzz-build ## run every fuzz target for FUZZ_SECONDS (default 30) each
	@tests/fuzz/run.sh $(BUILD)/fuzzing $${FUZZ_SECONDS:-30}

fuzz-build: deps-test
	@$(MAKE) --no-print-directory -s -j$$(nproc) $(BUILD)/libparts.a
	$(call sanitized,fuzzing,-fsanitize=address$(comma)undefined$(comma)fuzzer-no-link -fno-sanitize-recover=undefined) CC=clang fuzz-bins

ci: ## what continuous integration runs: test, asan, tsan, fuzz, and one count over all
	@.ci/run

# What reads and checks a request is under the fuzzer; what the linker wants besides, and no target runs, is that of the
# ordinary build in PLAIN.
FUZZED := $(wildcard $(addsuffix /*.c,server/codec $(addprefix solver/,assembly core element io law linalg obstacle scene text))) \
          server/store/uploads.c solver/methods/method.c solver/run/problem.c solver/run/settings.c
# No check of a scene comes to what is made of its answer.
FUZZED := $(filter-out $(addprefix solver/assembly/,error_estimate.c nodal_strains.c recover.c row_turn%.c strain_%.c stress_%.c thin_elements.c whole_norm.c),$(FUZZED))
.PHONY: fuzz-bins
fuzz-bins: $(FUZZ_BIN)
$(BUILD)/libfuzzed.a: $(call obj,$(FUZZED)) $(BUILD)/obj/gen/embedded.o
	@rm -f $@
	@ar rcs $@ $^
$(BUILD)/fuzz/%: $(BUILD)/obj/tests/fuzz/%.o $(BUILD)/libfuzzed.a $(PLAIN)/libparts.a $(PLAIN)/libuzawa.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS_ALL) -fsanitize=fuzzer -o $@ $^ $(SERVER_LIBS) $(CLIENT_LIBS)

# Runs a program that writes BUILD/NAME.json and stamps that: when, of which commit, beside what.
measured = $(PYTHON) -B tests/figures/measure.py $(BUILD) $(1)

bench: deps ## measured ratios in one run: a table and build/bench.json
	@$(MAKE) --no-print-directory -s $(BUILD)/bench $(BUILD)/uzawad
	@$(call measured,bench $(if $(FILTER),--part)) $(BUILD)/bench $(BUILD)/bench.json $(FILTER)
	@$(if $(FILTER),,$(MAKE) --no-print-directory -s $(BUILD)/guard && $(PYTHON) -B tests/guard/guard.py $(BUILD) --into $(BUILD)/bench.json)

bench-compare: ## OLD=a.json NEW=b.json: ratios of times and of instructions; fails past THRESHOLD (1.1) and 1.05
	@$(PYTHON) -B tests/bench/compare.py "$(OLD)" "$(NEW)" $(THRESHOLD)

bench-size: deps ## cost against size, to 2,000,000 dofs: a table and build/bench-size.json; minutes; CELLS="30 42" renews some
	@$(MAKE) --no-print-directory -s $(BUILD)/bench
	@$(call measured,bench-size $(if $(CELLS),--part)) $(BUILD)/bench $(BUILD)/bench-size.json size $(CELLS)

bench-solids: deps-test ## solids in contact without a factor, by shapes, materials, elements and load cases: tables and build/bench-solids.json; CELLS=32 along a side, RUNS=3; minutes
	@$(MAKE) --no-print-directory -s $(BUILD)/bench $(BUILD)/uzawad
	@$(call measured,bench-solids) /usr/bin/python3 -B tests/bench/solids.py $(BUILD) $(BUILD)/bench-solids.json $(foreach v,CELLS RUNS,$(if $($(v)),$(v)=$($(v))))

bench-predictions: deps ## what solves are expected to take against what they take, by bodies and forms of the operator: a table and build/bench-predictions.json; FILTER=element; minutes, and 3 GB
	@$(MAKE) --no-print-directory -s $(BUILD)/bench
	@$(call measured,bench-predictions) $(BUILD)/bench $(BUILD)/bench-predictions.json predictions $(FILTER)

bench-deps: ## install the Debian packages that only comparisons with other solvers use
	@tests/deps.sh $(PEER_PACKAGES)

peers: deps bench-deps ## the same problems by what Debian has, one certificate for all: tables and build/peers.json; SIZES="30 60", TIME=20, ONLY=, PROBLEMS=
	@$(MAKE) --no-print-directory -s $(PEER_LAB) $(PEER_BIN)
	@$(PYTHON) -B tests/peers/peers.py $(BUILD) $(foreach v,SIZES TIME ONLY PROBLEMS MEMORY,$(if $($(v)),$(v)="$($(v))"))
	@$(if $(SIZES)$(ONLY)$(PROBLEMS),,$(MAKE) --no-print-directory -s peers-contact peers-large peers-large-solids peers-space)

peers-contact: bench-deps $(BUILD)/uzawad ## two bodies in contact, by CalculiX and by the daemon: a table and build/peers-contact.json
	@$(PYTHON) -B tests/peers/calculix.py $(BUILD) $(BUILD)/peers-contact.json

DECKS ?= /usr/share/doc/calculix-ccx-test/examples/test
peers-decks: $(BUILD)/uzawad ## CalculiX's own decks with contact or ties by CalculiX and by the daemon: a table and build/decks.json; DECKS=folder
	@tests/deps.sh calculix-ccx calculix-ccx-test
	@$(call measured,decks) $(PYTHON) -B tests/peers/calculix.py $(BUILD) $(BUILD)/decks.json $(DECKS)

peers-large: bench-deps $(BUILD)/uzawad ## large deformation by CalculiX, GetFEM and the daemon: a table and build/peers-large.json; ONLY=part of a name
	@$(call measured,peers-large $(if $(ONLY),--part)) /usr/bin/python3 -B tests/peers/large.py $(BUILD) $(BUILD)/peers-large.json $(if $(ONLY),ONLY="$(ONLY)")

peers-large-solids: bench-deps $(BUILD)/uzawad ## two solids that slide under large deformation by CalculiX, GetFEM and the daemon: a table and build/large-solids.json; ONLY=part of a name
	@$(call measured,large-solids$(if $(ONLY),-part)) /usr/bin/python3 -B tests/peers/large_solids.py $(BUILD) $(BUILD)/large-solids.json $(if $(ONLY),ONLY="$(ONLY)")

peers-space: bench-deps $(BUILD)/uzawad ## solids in contact by the daemon against the linear solve of the same K by PETSc's GAMG: a table and build/peers-space.json; CELLS="32 64" along a side (32; 64: 5 GB), RUNS=3
	@OMP_THREAD_LIMIT=1 OMP_NUM_THREADS=1 $(call measured,peers-space) /usr/bin/python3 -B tests/peers/gamg.py $(BUILD) $(BUILD)/peers-space.json $(foreach v,CELLS RUNS,$(if $($(v)),$(v)="$($(v))"))

extremes: deps-test ## claims at the extremes, 1,000 generated scenes of bodies that touch, 300 of bodies on obstacles, 300 in other words, 500 of large deformation, 48 whose load grows until small deformation ceases to suffice, 100 with quantities, 30 of large deformation with quantities, 40 solids, bounds of known scenes: tables, build/extremes.json, build/contacts.json, build/obstacles.json, build/words.json, build/generated_large.json, build/thresholds.json, build/quantities.json, build/large_quantities.json, build/solids.json, build/bounds.json; FILTER=name: some, FILTER=contacts, obstacles, words, large, large_quantities, thresholds, quantities, solids or bounds: these scenes alone, SCENES=100: the first of them
	@$(MAKE) --no-print-directory -s $(BUILD)/extremes $(BUILD)/large-checker $(BUILD)/uzawad
	@$(if $(filter contacts obstacles words large large_quantities thresholds quantities solids bounds,$(FILTER)),,$(call measured,extremes$(if $(FILTER),-part)) $(BUILD)/extremes $(BUILD)/extremes$(if $(FILTER),-part).json $(FILTER))
	@$(if $(filter-out contacts,$(FILTER)),,$(PYTHON) -B tests/extremes/generated_contacts.py $(BUILD) $(BUILD)/contacts.json $(SCENES))
	@$(if $(filter-out obstacles,$(FILTER)),,$(PYTHON) -B tests/extremes/generated_obstacles.py $(BUILD) $(BUILD)/obstacles.json $(SCENES))
	@$(if $(filter-out words,$(FILTER)),,$(PYTHON) -B tests/extremes/generated_words.py $(BUILD) $(BUILD)/words.json $(SCENES))
	@$(if $(filter-out large,$(FILTER)),,$(PYTHON) -B tests/extremes/generated_large.py $(BUILD) $(BUILD)/generated_large.json $(SCENES))
	@$(if $(filter-out thresholds,$(FILTER)),,$(call measured,thresholds) $(PYTHON) -B tests/extremes/large_thresholds.py $(BUILD) $(BUILD)/thresholds.json $(SCENES))
	@$(if $(filter-out quantities,$(FILTER)),,$(call measured,quantities) $(PYTHON) -B tests/extremes/generated_quantities.py $(BUILD) $(BUILD)/quantities.json $(SCENES))
	@$(if $(filter-out large_quantities,$(FILTER)),,$(PYTHON) -B tests/extremes/generated_large_quantities.py $(BUILD) $(BUILD)/large_quantities.json $(or $(SCENES),30))
	@$(if $(filter-out solids,$(FILTER)),,$(call measured,solids) $(PYTHON) -B tests/extremes/generated_solids.py $(BUILD) $(BUILD)/solids.json $(SCENES))
	@$(if $(filter-out bounds,$(FILTER)),,$(call measured,bounds) $(PYTHON) -B tests/extremes/bounds.py $(BUILD) $(BUILD)/bounds.json)

theory: deps ## stress and contact pressure against theory on finer and finer meshes: a table and build/theory.json
	@$(MAKE) --no-print-directory -s $(BUILD)/theory
	@$(call measured,theory) $(BUILD)/theory $(BUILD)/theory.json

roller: $(BUILD)/uzawad ## a roller pushed into a block, graded meshes, from either side: the force that contact that moves converges to; minutes
	@$(PYTHON) -B tests/theory/roller.py $(BUILD)

arch: $(BUILD)/uzawad ## a clamped arch that goes through, finer and finer meshes: its limit load; seconds
	@$(PYTHON) -B tests/theory/arch.py $(BUILD)

large: $(BUILD)/uzawad ## scenes of large deformation against what is known, and over one solve of small deformation: a table and build/large.json; a minute; ONLY=part of a name
	@$(call measured,large) $(PYTHON) -B tests/theory/large.py $(BUILD) $(BUILD)/large.json $(if $(ONLY),ONLY="$(ONLY)")

trade: $(BUILD)/uzawad ## what a whole error of 10, 5, 2 and 1 % costs, by estimate and guaranteed, and a contact force within 2 %: tables and build/trade.json; minutes; FILTER=words: bodies by their names, "force" of forces alone
	@$(call measured,trade $(if $(FILTER),--part)) $(PYTHON) -B tests/figures/trade.py $(BUILD) $(BUILD)/trade.json $(FILTER)

page-size: $(BUILD)/gen/page.c
	@$(call measured,page) $(PYTHON) -B tests/figures/page_size.py $(BUILD)/gen/page $(BUILD)/page.json

figures: deps ## measure work against precision, iterations and time: docs/numbers.md with its figures, and what other pages cite; minutes; FILTER="precision hertz" renews a part
	@$(MAKE) --no-print-directory -s $(BUILD)/figures
	@$(call measured,figures $(if $(FILTER),--part)) $(BUILD)/figures $(BUILD)/figures.json $(FILTER)
	@$(MAKE) --no-print-directory -s page-size
	@$(PYTHON) -B tests/figures/numbers_page.py collect $(BUILD)

collect: ## docs/numbers.md and what other pages cite of it, from what was measured since, without measuring
	@$(PYTHON) -B tests/figures/numbers_page.py collect $(BUILD)

numbers: ## measure everything that docs/numbers.md shows (hours: soak is one of it), then write them; SPARED="soak" leaves some out
	@for part in $(filter-out $(SPARED),theory large gallery trade extremes bench bench-size bench-solids bench-predictions $(if $(wildcard tests/peers/*),peers) soak figures); do \
	    $(MAKE) --no-print-directory $$part || exit 1; done

##@ Style
.PHONY: format lint
format: ## rewrite the sources in the project's format
	clang-format -i $(C_FILES) $(H_FILES)

lint: ## formatting, cppcheck, and both compilers with every warning an error
	@tests/lint.sh

print-sources:
	@printf '%s\n' $(C_FILES) $(H_FILES)

-include $(shell find $(BUILD)/obj -name '*.d' 2>/dev/null)
