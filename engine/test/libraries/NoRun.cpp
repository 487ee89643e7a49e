// A shared library that exports no run.
