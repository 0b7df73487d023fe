"""What a browser loads of the web page, as it is sent (gzip): the HTML, the styles, a module and all that it imports at once; for
the list of jobs, and for the first job with its curves. usage: page_size.py FOLDER OUTPUT.json"""
import json
import pathlib
import re
import sys

# import"./x.js" and from"./x.js"; import("./x.js") loads later.
AT_ONCE = re.compile(r"""(?:\bfrom|\bimport)\s*["']\.?/(?:page/)?([\w.-]+\.js)["']""")


def loaded(folder, *modules):
    """Names of the files, without .gz."""
    wanted, found = ["index.html", *(next(folder.glob(name)).name for name in ("page-*.css", *modules))], []
    while wanted:
        name = wanted.pop()
        if name not in found:
            found.append(name)
            if name.endswith(".js"):
                wanted += AT_ONCE.findall((folder / name).read_text())
    return found


def sent(folder, *modules):
    return sum((folder / f"{name}.gz").stat().st_size for name in loaded(folder, *modules))


def main():
    folder, output = (pathlib.Path(argument) for argument in sys.argv[1:3])
    output.write_text(json.dumps({"list_bytes": sent(folder, "main-*.js"), "job_bytes": sent(folder, "main-*.js", "job-*.js")}))


if __name__ == "__main__":
    main()
