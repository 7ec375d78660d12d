"""The command that draws every figure of both texts: ``python -m rbcourse all --folder FOLDER``."""

from rbcourse import paper, report
from rbcourse.draw.drawing import run

if __name__ == "__main__":
    texts = {"BK": paper.FIGURES, "RR": report.FIGURES}
    run("rbcourse", {text + name: draw for text in texts for name, draw in texts[text].items()})
