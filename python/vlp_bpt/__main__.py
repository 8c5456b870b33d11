"""`python -m vlp_bpt` is `vlp-bpt`."""

import sys

from .cli import main

sys.exit(main())
