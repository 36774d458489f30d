from .correlation_file import read_correlation as read_correlation
from .correlation_file import run_correlation as run_correlation
from .correlation_report import correlation_page as correlation_page
from .mesh_convergence import MeshConvergence as MeshConvergence
from .mesh_convergence import mesh_convergence as mesh_convergence
