"""`quadrille`, or `python -m quadrille`: the command line, from any folder."""

from quadrille import require_own


def program() -> None:
    """Run the command line, though the working folder or PYTHONPATH may hold another project's `app`."""
    for package in ("tracker", "app"):
        require_own(package)
    from app.main import program as run

    run()


if __name__ == "__main__":
    program()
