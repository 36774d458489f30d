from .correlation_file import correlate as correlate
from .correlation_file import read_correlation as read_correlation
from .correlation_report import correlation_document as correlation_document
from .mesh_convergence import MeshConvergence as MeshConvergence
from .mesh_convergence import mesh_convergence as mesh_convergence
