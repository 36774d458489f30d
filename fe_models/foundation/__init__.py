"""Foundation of all packages: arrays, units, message texts, errors, files, threads. It imports no other package."""
