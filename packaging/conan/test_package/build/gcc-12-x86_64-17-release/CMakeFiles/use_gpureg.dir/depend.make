# Empty dependencies file for use_gpureg.
# This may be replaced when dependencies are built.
