"""The configuration of Sphinx for the sources of the book; Sphinx reads this file itself."""

import json
import os
import re
from importlib import import_module
from pathlib import Path
from typing import Any

from rbclassroom.book.places import anchor, file_of, fragment
from rbclassroom.course.ledger import KEY
from rbclassroom.lecture.deck import mathjax

project = html_title = "Rigid-body motion"
author = "The rbcourse authors"
default_role = "py:obj"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.linkcode", "sphinx.ext.mathjax"]
extensions += ["numpydoc"]

nb_execution_mode = "off"
nb_merge_streams = True
nb_code_prompt_show, nb_code_prompt_hide = "Show the code", "Hide the code"
myst_enable_extensions = ["amsmath", "dollarmath"]
autodoc_preserve_defaults = True
autodoc_typehints = "none"
numpydoc_show_class_members = False
toc_object_entries = False  # if true, the navigation of each page lists all objects

html_theme = "furo"
html_domain_indices = False
html_static_path = ["static"]
html_css_files = ["book.css"]
html_js_files = ["book.js"]
exclude_patterns = ["files"]
html_favicon = "static/favicon.svg"
html_copy_source = html_show_sourcelink = html_show_sphinx = html_show_copyright = False
html_show_search_summary = False  # a page opened from disk cannot read others; see `write_texts`
mathjax_path = "tex-svg.js"
mathjax3_config = {"svg": {"scale": 0.97, "mtextInheritFont": True}}


def name_sections(_app: Any, doctree: Any) -> None:
    """Give the headings of lessons permanent addresses, such as ``#s3`` for section 3."""
    if Path(doctree["source"]).parent.name == "lessons":
        for section in doctree.findall(lambda node: node.tagname == "section"):
            if section.parent is not doctree:
                section["ids"] = [fragment(section.children[0].astext())]


def skip_foreign(_app: Any, _what: str, _name: str, obj: Any, _skip: bool, _: Any) -> bool | None:
    """Omit members of other packages, and fields of tuples, which have no text of their own."""
    if (getattr(obj, "__doc__", None) or "").startswith("Alias for field number"):
        return True
    module = getattr(obj, "__module__", None) or "rbcourse"
    return None if module.startswith(("rbcourse", "rbclassroom")) else True


def join_ledger(_app: Any, _: str, __: str, ___: Any, ____: Any, lines: list[str]) -> None:
    """Link the keys in a docstring to the ledger."""
    for i, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            lines[i] = KEY.sub(lambda key: f"`{key[0]} <../ledger.html#{anchor(key[0])}>`__", line)


def find_anywhere(app: Any, env: Any, node: Any, content: Any) -> Any:
    """Return a link for a name if exactly one module of the book defines it."""
    from sphinx.util.nodes import make_refnode

    found = [
        (name, entry.docname)
        for name, entry in env.domains["py"].objects.items()
        if name.endswith(f".{node['reftarget']}") and ".textbook." not in name
        if entry.objtype in ("class", "data", "exception", "function") and not entry.aliased
    ]
    if len(found) == 1 and node["refdomain"] == "py":
        name, page = found[0]
        return make_refnode(app.builder, node["refdoc"], page, name, content)
    return None


def linkcode_resolve(_domain: str, found: dict[str, str]) -> str:
    """Return the address of the page with the source code of an object."""
    name = found["fullname"].partition(".")[0]
    home = getattr(getattr(import_module(found["module"]), name), "__module__", "")
    if not home.startswith(("rbcourse", "rbclassroom")):  # a constant
        home = found["module"]
    file = file_of(home.partition(".")[2])
    return f"../code/{file.removesuffix('.py')}.html#{name}"


def write_texts(app: Any, failed: Exception | None) -> None:
    """Write the words of all pages to a file; search results show excerpts from this file."""
    if failed:
        return
    texts = {}
    for name in sorted(app.env.found_docs):
        leaves = app.env.get_doctree(name).findall(lambda node: not node.children)
        apart = {"comment", "math", "math_block", "raw"}
        shown = [x.astext() for x in leaves if not {x.tagname, x.parent.tagname} & apart]
        texts[name] = re.sub(r"\s+", " ", " ".join(shown))
    text = f"window.rbcourseTexts = {json.dumps(texts, ensure_ascii=False)};\n"
    (Path(app.outdir) / "_static" / "texts.js").write_text(text, encoding="utf-8", newline="\n")


def add_python(app: Any, name: str, _template: str, _context: Any, _doctree: Any) -> None:
    """Let Python run in the pages of lessons and problem sets, if the book contains Python."""
    live = Path(os.environ["RBCOURSE_BOOK_EXTRA"], "_static", "live")
    if live.exists() and name.startswith(("lessons/", "problems/")):
        app.add_css_file("live/live.css")
        for script in ("engine", "live"):
            app.add_js_file(f"live/{script}.js")


def setup(app: Any) -> None:
    """Add MathJax and the extra files, and connect the functions above to the events of Sphinx.

    `name_sections` is called before Sphinx collects the contents of a page.
    """
    app.config.html_static_path.append(str(mathjax()))
    app.config.html_extra_path.append(os.environ["RBCOURSE_BOOK_EXTRA"])
    app.connect("autodoc-skip-member", skip_foreign)
    app.connect("doctree-read", name_sections, priority=400)
    app.connect("autodoc-process-docstring", join_ledger, priority=900)
    app.connect("missing-reference", find_anywhere)
    app.connect("html-page-context", add_python)
    app.connect("build-finished", write_texts)
