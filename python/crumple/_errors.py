"""The error of crumple: the program's own text, its code, and its place in a file."""

import json


class Error(Exception):
    """What the program would have said.

    Attributes: `code` (a word that never changes its meaning, see docs/error-codes.md), `file`, `line` and `column`
    (counted from 1; None where they are not known), `hint`, and `causes`, a list of texts; `document`, what a command has
    printed that failed by `strict` alone, else None.
    """

    def __init__(self, message, code=None, file=None, line=None, column=None, hint=None, causes=()):
        super().__init__(message)
        self.code, self.file, self.line, self.column = code, file, line, column
        self.hint, self.causes = hint, list(causes)
        self.document = None

    @classmethod
    def of_document(cls, document):
        """Of the JSON document that a command prints when it fails."""
        return cls(**json.loads(document)["error"])

    def __reduce__(self):
        args = (str(self), self.code, self.file, self.line, self.column, self.hint, self.causes)
        return (type(self), args, self.__dict__)
