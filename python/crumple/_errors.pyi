from collections.abc import Iterable
from typing import Any, Self

class Error(Exception):
    code: str | None
    file: str | None
    line: int | None
    column: int | None
    hint: str | None
    causes: list[str]
    document: dict[str, Any] | list[Any] | None
    def __init__(
        self,
        message: str,
        code: str | None = None,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        hint: str | None = None,
        causes: Iterable[str] = (),
    ) -> None: ...
    @classmethod
    def of_document(cls, document: str | bytes) -> Self: ...
    def __reduce__(self) -> tuple[type[Self], tuple[object, ...], dict[str, Any]]: ...
