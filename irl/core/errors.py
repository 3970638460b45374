"""The one exception that means "the caller can mend this"."""


class UserError(ValueError):
    """Something the user gave cannot be used.

    The message is one line: what was given, what was expected, and what to type instead. The
    command line prints it to stderr and exits with 2; a traceback is shown with `--debug` only.
    """
