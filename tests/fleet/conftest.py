"""Real processes, and a real browser before them."""

from tests.console.conftest import browser, chromium
from tests.e2e.conftest import no_program_outlives_its_tests, programs_words

__all__ = ["browser", "chromium", "no_program_outlives_its_tests", "programs_words"]
