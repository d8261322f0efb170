"""Errors that a user can mend: one sentence that says what was given, what is allowed and what to do."""


class UserError(ValueError):
    """Wrong input; the command line prints the message and exits with 2."""
