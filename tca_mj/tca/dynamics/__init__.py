"""Motion of TCAs that lift weights or pull on springs."""
