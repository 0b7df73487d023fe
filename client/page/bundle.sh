#!/usr/bin/env bash
# Bundles the web page: client/page and the libraries from Debian become a few small files in BUILD/gen/page, each with
# its gzip, and BUILD/gen/page.c, which puts them into the daemon (server/http/page.h).
# usage: client/page/bundle.sh BUILD
# Every name but index.html's has a hash of the content in it, so that a browser may keep such a file for ever.
set -euo pipefail
build=$1
out=$build/gen/page
command -v esbuild >/dev/null || { echo "esbuild is missing: make deps installs it" >&2; exit 1; }
rm -rf "$out"
mkdir -p "$out"

# Debian has its ES modules where node finds them. JSON files are the examples of the editor: loaded when chosen.
NODE_PATH=/usr/share/nodejs esbuild client/page/main.js client/page/page.css --bundle --minify --splitting \
    --format=esm --target=es2020 --charset=utf8 --legal-comments=none --log-level=warning \
    --loader:.json=file --loader:.svg=file \
    --public-path=/page/ --entry-names=[name]-[hash] --chunk-names=[name]-[hash] --asset-names=[name]-[hash] \
    --outdir="$out"
name_of() { basename "$out"/"$1"-????????."$2"; }
sed -e "s/main\.js/$(name_of main js)/" -e "s/page\.css/$(name_of page css)/" client/page/index.html >"$out/index.html"

media_type() { # FILE
    case $1 in
    *.html) echo "text/html; charset=utf-8" ;;
    *.js) echo "text/javascript; charset=utf-8" ;;
    *.css) echo "text/css; charset=utf-8" ;;
    *.json) echo "application/json" ;;
    *.svg) echo "image/svg+xml" ;;
    *) echo "no media type is known for $1" >&2; return 1 ;;
    esac
}

count=0 table=
{
    echo '#include "http/page.h"'
    for file in "$out"/*; do
        gzip -9nk "$file"
        type=$(media_type "$file")
        for part in "plain $file" "gzip $file.gz"; do
            symbol=page_${part%% *}_$count
            printf '__asm__(".section .rodata\\n%s: .incbin \\"%s\\"\\n%s_end: .byte 0\\n.text");\n' "$symbol" "${part#* }" "$symbol"
            printf 'extern const char %s[], %s_end[];\n' "$symbol" "$symbol"
        done
        table+="    if (i == $count) return (page_file){\"$(basename "$file")\", \"$type\", page_plain_$count, page_gzip_$count, (size_t)(page_plain_${count}_end - page_plain_$count), (size_t)(page_gzip_${count}_end - page_gzip_$count)};"$'\n'
        count=$((count + 1))
    done
    printf 'page_file page_file_at(size_t i) {\n%s    return (page_file){0, 0, 0, 0, 0, 0};\n}\n' "$table"
} >"$build/gen/page.c.new"
mv "$build/gen/page.c.new" "$build/gen/page.c"
