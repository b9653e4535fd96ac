"""The local web page: campaigns to look at and to add to, each page with a JSON twin; on loopback alone."""
