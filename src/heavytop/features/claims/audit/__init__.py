"""From a claim, of the paper or in a file, to a verdict for every equation."""

from heavytop.extras import require_extra

require_extra("claims")
