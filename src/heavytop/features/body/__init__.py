"""Bodies out of files of robots: whether a tensor is that of a body, and which slip in it makes it one."""
