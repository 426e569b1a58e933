"""What all tests share."""

import signal

# A shell starts background jobs with Ctrl-C ignored, and so would be whoever runs these tests in one; the tests of
# Ctrl-C need it as a person at a terminal has it.
signal.signal(signal.SIGINT, signal.default_int_handler)
