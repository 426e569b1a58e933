"""`python -m carom`: the same as the command `carom`."""

import sys

from carom.command_line import main

sys.exit(main())
