"""Contact scenarios; later: Recording -> Impact."""
