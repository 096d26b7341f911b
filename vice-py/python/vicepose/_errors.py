"""What goes wrong, by kind."""

from __future__ import annotations


class Error(Exception):
    """An error of VICE; the classes below say of which kind.

    Attributes
    ----------
    path : str or None
        The file or folder at fault.
    line, byte : int or None
        The place in the file: lines count from 1, bytes from 0.
    hint : str or None
        What can be done about it.
    argument : str or None
        The argument that makes no sense.
    """

    path: str | None
    line: int | None
    byte: int | None
    hint: str | None
    argument: str | None

    def __init__(
        self,
        message: str = "",
        *,
        path: str | None = None,
        line: int | None = None,
        byte: int | None = None,
        hint: str | None = None,
        argument: str | None = None,
    ) -> None:
        super().__init__(message)
        self.path = path
        self.line = line
        self.byte = byte
        self.hint = hint
        self.argument = argument

    def __reduce__(self) -> tuple[object, ...]:
        return _again, (type(self), str(self), self.__dict__)


def _again(kind: type[Error], message: str, values: dict[str, object]) -> Error:
    error = kind(message)
    error.__dict__.update(values)
    return error


class MissingError(Error):
    """A file, stream, camera or topic that is asked for is not there."""


class CorruptError(Error):
    """Bytes or numbers that cannot be what they should be."""


class UnsupportedError(Error):
    """Well-formed data that VICE does not read."""


class ContradictoryError(Error):
    """Two statements of the data, or of the data and the call, that exclude each other."""


class UsageError(Error, ValueError):
    """A call that makes no sense, whatever the data."""


class InternalError(Error):
    """A defect of VICE. Please report it."""
