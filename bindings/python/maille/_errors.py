"""What is raised when something cannot be done."""

from __future__ import annotations

import enum


class ErrorCode(enum.IntEnum):
    """What went wrong, in kind; the numbers are the exit codes of the command."""

    DIFFERS = 1
    """A comparison found a difference."""
    USAGE = 2
    """Arguments contradict each other or make no sense."""
    CANNOT_READ = 3
    """The input is missing or unreadable (an OSError)."""
    MALFORMED_INPUT = 4
    """A foreign file (PLY, OBJ, ...) or a mesh breaks its own rules."""
    UNSUPPORTED = 5
    """Needs another version of maille, or a feature that does not exist."""
    CORRUPT = 6
    """A .maille file is damaged."""
    MEMORY_BOUND = 7
    """Cannot be done within the memory allowed (a MemoryError)."""
    ERROR_BOUND = 8
    """Not given by this version."""
    WRITE_FAILED = 9
    """The output could not be written (an OSError)."""
    NETWORK = 10
    """A web server failed (an OSError)."""
    CANCELLED = 130
    """The progress function returned False (a KeyboardInterrupt)."""


class Error(ValueError):
    """A file or an argument is not as it must be: one sentence, and ``code``, an :class:`ErrorCode`.

    >>> import maille
    >>> try:
    ...     maille.decode(b"no mesh at all")
    ... except maille.Error as error:
    ...     print(error.code.name)
    CORRUPT
    """

    code: ErrorCode

    def __init__(self, message: str, code: int = ErrorCode.USAGE) -> None:
        super().__init__(message)
        self.code = ErrorCode(code)

    def __reduce__(self) -> tuple[type[Error], tuple[str, int]]:
        return Error, (str(self), int(self.code))


class MailleWarning(UserWarning):
    """What a user should know of a file that was read or written all the same: points that were welded, an
    array that the format cannot hold."""


_of_the_system = {
    ErrorCode.CANNOT_READ: OSError,
    ErrorCode.WRITE_FAILED: OSError,
    ErrorCode.NETWORK: OSError,
    ErrorCode.MEMORY_BOUND: MemoryError,
    ErrorCode.CANCELLED: KeyboardInterrupt,
}


def exception_of(code: int, message: str) -> BaseException:
    """What maille._core raises for an error of the library."""
    kind = _of_the_system.get(ErrorCode(code))
    if kind is None:
        return Error(message, code)
    exception = kind(message)
    exception.code = ErrorCode(code)  # type: ignore[attr-defined]
    return exception
