"""Pages of source code, with an anchor for each definition: what the reference points to."""

import ast
import html
from pathlib import Path
from string import Template

from pygments import format as formatted
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer
from pygments.token import Comment, Keyword, Number, String, Token

_COLOURED = (Comment, Keyword, Number, String)
_PAGE = Template("""\
<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>$path</title><link rel="icon" href="${up}_static/favicon.svg">
<link rel="stylesheet" href="${up}_static/code.css"></head>
<body><p><a href="${up}index.html">Rigid-body motion</a> · <a href="${up}package/index.html">\
the package</a></p><h1>$path</h1><pre>$code</pre></body></html>
""")


def code_page(path: str, root: Path) -> str:
    """Return a Python file of the course as a page in the folder ``code``, as HTML."""
    source = (root / path).read_text(encoding="utf-8")
    tokens = (
        (next((kind for kind in _COLOURED if found in kind), Token), text)
        for found, text in PythonLexer(stripnl=False).get_tokens(source)
    )
    lines = formatted(tokens, HtmlFormatter(nowrap=True)).split("\n")
    for node in ast.parse(source).body:
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                pass
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                pass
            case _:
                continue
        lines[node.lineno - 1] = f'<a id="{name}"></a>{lines[node.lineno - 1]}'
    up = "../" * (path.count("/") + 1)
    return _PAGE.substitute(path=html.escape(path), up=up, code="\n".join(lines))
