"""Commands that inspect CAD files and their meshes."""
