# bundle.awk: openapi.json and all schemas as one document whose references are all within it, for generators of clients,
# of which many follow none to other files, or to a place that is no component.
# usage: awk -f bundle.awk SCHEMA... openapi.json
#
# A schema becomes the component NAME, each of its $defs the component NAME.DEF. It reads files as they are laid out
# here: members of the root begin behind two blanks, those of $defs behind four.

FNR == 1 {
    finish()
    file = FILENAME
    sub(/^.*\//, "", file)
    sub(/\.json$/, "", file)
}
file == "openapi" {
    print local($0)
    if ($0 == "  \"components\": {")
        print "    \"schemas\": {\n" components "\n    },"
    next
}
/^[{}]/ { next }
/^  "\$defs": \{$/ { begin(); in_defs = 1; next }
in_defs && /^  \}/ { begin(); in_defs = 0; next }
in_defs && /^    "/ { begin(); name = $0; sub(/^    "/, "", name); sub(/".*/, "", name); sub(/^    "[^"]*": /, "") }
!in_defs && /^  "/ { begin() }
{ text = text (text == "" ? "" : "\n") local($0) }

# What was read is whole: a definition, or a member of the root.
function begin() {
    sub(/,$/, "", text)
    if (text != "" && in_defs)
        add(file "." name, text)
    else if (text != "" && text !~ /^  "\$(schema|id)"/)
        root = root (root == "" ? "" : ",\n") text
    text = ""
}

function finish() {
    begin()
    if (root != "")
        add(file, "{\n" root "\n}")
    root = ""
}

function add(called, schema) {
    components = components (components == "" ? "" : ",\n") "\"" called "\": " schema
}

# A line with its references as those of this document.
function local(line,   out) {
    out = ""
    while (match(line, /"\$ref": "[^"]*"/)) {
        out = out substr(line, 1, RSTART - 1) "\"$ref\": \"" target(substr(line, RSTART + 9, RLENGTH - 10)) "\""
        line = substr(line, RSTART + RLENGTH)
    }
    return out line
}

function target(to,   at, of, rest) {
    at = index(to, "#")
    of = at ? substr(to, 1, at - 1) : to
    rest = at ? substr(to, at + 1) : ""
    if (of == "" && file == "openapi")
        return to
    sub(/\.json$/, "", of)
    sub(/^\/\$defs\//, ".", rest)
    return "#/components/schemas/" (of == "" ? file : of) rest
}
