"""`python -m sgimp_post` is `sgimp-post`."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
