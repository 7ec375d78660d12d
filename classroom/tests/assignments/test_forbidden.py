"""Code that replaces names used by the tests is reported; ordinary code is not."""

import pytest
from nbformat.v4 import new_code_cell

from rbclassroom.assignments.forbidden import find_in_cells

LOCKED = [
    "import math, numpy as np\nfrom rbcourse import marking\ndef helper(): pass",
    "assert all(isinstance(v, float) for v in np.ravel(answer(2))) and P.accepts(answer)",
    "assert math.isclose(1, 1)",
]


def found(source, locked=LOCKED):
    """Return the remarks on a student's cell that follows locked cells."""
    marks = {"grade_id": "locked", "locked": True}
    cells = [new_code_cell(text, metadata={"nbgrader": marks}) for text in locked]
    return [(line, what) for _, line, what in find_in_cells([*cells, new_code_cell(source)])]


@pytest.mark.parametrize(
    ("source", "what"),
    [
        ("import numpy as np; np.allclose = lambda *a, **k: True", "replaces np.allclose"),
        ("from rbcourse import marking; marking.check = print", "replaces marking.check"),
        ("import numpy.testing as t\nt.assert_allclose = print", "replaces t.assert_allclose"),
        ("other = np\nother.allclose = print", "replaces other.allclose"),
        ("del np.allclose", "replaces np.allclose"),
        ("np.linalg.norm += 1", "replaces np.linalg.norm"),
        ("np.allclose.__code__ = f.__code__", "replaces np.allclose.__code__"),
        ("P = [marking.Problem][0]\nP.accepts = print", "replaces P.accepts"),
        ("%%time\nnp.allclose = print", "replaces np.allclose"),
        ("%timeit np.linalg.norm = print", "replaces np.linalg.norm"),
        ("%time (\nnp.allclose = print", "uses a magic or a shell"),
        ("%run other.py", "uses a magic or a shell"),
        ("!ls", "uses a magic or a shell"),
        ("np.__dict__['allclose'] = print", "uses __dict__"),
        ("%%capture out\n%timeit -n 3 np.allclose = print", "replaces np.allclose"),
        ('locals()["np"] = None', "uses locals"),
        ("globals()['math'] = None", "uses globals"),
        ("exec('import math; math.isclose = print')", "uses exec"),
        ("__import__('builtins').abs = print", "uses __import__"),
        ("x.ast_transformers.append(None)", "uses ast_transformers"),
        ("def f():\n    yield\nf().gi_frame.f_back", "uses f_back"),
        ("import gc", "imports gc"),
        ("import sys\nsys.modules['numpy'] = None", "uses modules"),
        ("import sys\nsys.setprofile(None)", "uses setprofile"),
        ("x.input_transformers_post.append(print)", "uses input_transformers_post"),
        ("import sys\nsys.modules['IPython'].get_ipython()", "uses get_ipython"),
        ("print(In[-1])", "uses In"),
        ("put = setattr\nput(math, 'isclose', print)", "uses setattr"),
        ("getattr(x, 'mod' + 'ules')", "uses getattr(x, 'mod' + 'ules')"),
        ("import operator\noperator.attrgetter('x')", "uses attrgetter"),
        ("type('Y', (), {'__code__': print})", "names __code__"),
        ("import builtins\nbuiltins.AssertionError = int", "imports builtins"),
        ("from unittest import mock", "imports unittest"),
        ("class math:\n    isclose = print", "gives math another meaning"),
        ("import json as math", "gives math another meaning"),
        ("all = print", "gives all another meaning"),
        ("def f():\n    global np\n    np = 1", "gives np another meaning"),
        ("[0 for _ in [0] if (math := 1)]", "gives math another meaning"),
        ("match 1:\n    case math: pass", "gives math another meaning"),
    ],
)
def test_code_that_replaces_names_used_by_tests_is_reported(source, what):
    assert what in [said for _, said in found(source)]


@pytest.mark.parametrize(
    "source",
    [
        "import matplotlib.pyplot as plt\nplt.rcParams['font.size'] = 9\nplt.rcParams.update({})",
        "%matplotlib inline\n%config InlineBackend.figure_format = 'retina'",
        "%%time\nx = 1",
        "%timeit -n 3 -r 2 x = 1",
        "%load_ext autoreload\n%autoreload 2",
        "np.eye?\n?np.eye",
        "import numpy as np, math\nfrom math import pi\nimport math as m",
        "class Arm:\n    def __init__(self):\n        self.x = 1\narm = Arm()\narm.y = 2",
        "T = np.eye(4)\nT.shape = 2, 8\nT[0] = 1",
        "fig, ax = plt.subplots()\nax.mine = 1",
        "def norm(np):\n    math = 1\n    return np",
        "[np for np in range(3)]",
        "np.random.seed(0)\nnp.set_printoptions(precision=3)",
        "from IPython.display import HTML, display\nimport IPython.display as ipd",
        "from IPython.core.display import HTML, display\nfrom IPython import display",
        "def isclose(a, b):\n    return abs(a - b) < 1e-9",
        "from ipywidgets import interact\nfrom tqdm.auto import tqdm\nfrom threading import Thread",
        "class Body:\n    def accepts(self):\n        self.accepts = 1",
        "import re\nre.compile('a')\ngetattr(plt, 'figure')()\nsum = 3",
        "this is no Python (",
        "f = " + "lambda: (a := " * 40 + "1" + ")" * 40,
    ],
)
def test_ordinary_code_is_accepted(source):
    assert found(source) == []


def test_remarks_state_the_number_of_the_line_in_the_cell():
    assert found("\n\nx = 1\nnp.allclose = print") == [(4, "replaces np.allclose")]
    assert found("%%time\nx = 1\nnp.allclose = print") == [(3, "replaces np.allclose")]


def test_another_way_to_import_the_same_module_is_accepted():
    locked = ["import matplotlib.pyplot as plt\nimport math\nmath.tau = 6"]
    assert found("from matplotlib import pyplot as plt", locked) == []
    assert found("from json import tool as plt", locked)


def test_long_code_is_checked_in_linear_time():
    """If the time were quadratic, this test would take years instead of a second."""
    assert found("%matplotlib" + " " * 10**6 + ";")
