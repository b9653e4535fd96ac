"""forcemap: from measured impacts to a bounded collision-force map and safe robot speeds."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)  # the public names stand in __init__.pyi
