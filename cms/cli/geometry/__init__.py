"""Commands that look at CAD files and their meshes."""
