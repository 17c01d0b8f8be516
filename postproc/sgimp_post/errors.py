"""The one error a user is meant to see."""


class PostError(Exception):
    """Bad input: one line that says what is wrong and where. Exit code 2."""
