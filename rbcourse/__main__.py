"""The command that draws every figure of both texts: ``python -m rbcourse all --folder FOLDER``."""

try:
    from rbcourse import paper, report
    from rbcourse.draw.drawing import run
except ImportError as error:
    raise SystemExit("\n".join([str(error), *getattr(error, "__notes__", [])])) from None

if __name__ == "__main__":
    texts = {"BK": paper.FIGURES, "RR": report.FIGURES}
    run("rbcourse", {text + name: draw for text in texts for name, draw in texts[text].items()})
