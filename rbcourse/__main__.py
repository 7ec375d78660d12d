"""The command that draws every figure of both texts: ``python -m rbcourse all --folder FOLDER``."""

try:
    from rbcourse import paper, report
    from rbcourse.draw.drawing import run
except ImportError as error:
    raise SystemExit("\n".join([str(error), *getattr(error, "__notes__", [])])) from None

FIGURES = {f"BK{name}": draw for name, draw in paper.FIGURES.items()}
FIGURES |= {f"RR{name}": draw for name, draw in report.FIGURES.items()}

if __name__ == "__main__":
    run(FIGURES)
