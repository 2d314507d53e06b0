"""Base class of dataclasses whose arrays are views of the memory of a native object."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any, Generic, Protocol, TypeVar

from feedplan.arrays import lock_arrays

Record = TypeVar("Record", bound="OfNative[Any]")


class HasFields(Protocol):
    """A native object."""

    def fields(self) -> dict[str, Any]:
        """Its arrays by name: read-only views of its memory."""


Native = TypeVar("Native", bound=HasFields)


class OfNative(Generic[Native]):
    """A frozen dataclass, some of whose fields are views of the memory of `native`.

    The native object is made with the record and checks these fields once; kernels take this object.
    """

    native: Native

    @classmethod
    def of(cls: type[Record], native: Native, **others: Any) -> Record:
        """The record of a native object; `others` are fields that the native object lacks."""
        record = object.__new__(cls)
        for field in fields(record):  # type: ignore[arg-type]
            if field.default is not MISSING:
                others.setdefault(field.name, field.default)
            elif field.default_factory is not MISSING and field.name not in others:
                others[field.name] = field.default_factory()
        vars(record).update(others)
        record._hold(native)
        return record

    def with_others(self: Record, **others: Any) -> Record:
        """The same record with other values of fields that the native object lacks."""
        record = object.__new__(type(self))
        vars(record).update(vars(self), **others)
        lock_arrays(record)
        return record

    def _hold(self, native: Native) -> None:
        vars(self).update(native.fields(), native=native)
        lock_arrays(self)  # arrays that are not the native object's

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        return type(self), tuple(getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
