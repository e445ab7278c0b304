"""What holds for all tests: how they are shared between processes, and how many may be skipped."""

from halves import pytest_addoption, pytest_configure
from hypothesis import settings
from searching import search
from skips import pytest_sessionfinish

__all__ = ["pytest_addoption", "pytest_configure", "pytest_sessionfinish"]

settings.register_profile("search", search())
settings.load_profile("search")
