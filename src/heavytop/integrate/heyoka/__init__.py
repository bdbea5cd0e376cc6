"""heyoka's Taylor integrators."""
