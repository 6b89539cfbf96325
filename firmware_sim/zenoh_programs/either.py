"""Classes that stand in for the library's; `isinstance` holds for objects of both, as other threads have the real."""

from __future__ import annotations

from types import GenericAlias
from typing import Any, ClassVar


class Either(type):
    """Metaclass of a class that replaces `real` in the library's module."""

    real: Any

    def __instancecheck__(cls, instance: object) -> bool:
        return super().__instancecheck__(instance) or isinstance(instance, cls.real)


class StandIn(metaclass=Either):
    """Base of the classes that replace the library's; `real` is what each replaces."""

    real: ClassVar[Any] = ()

    def __class_getitem__(cls, item: Any) -> GenericAlias:
        return GenericAlias(cls, item)
