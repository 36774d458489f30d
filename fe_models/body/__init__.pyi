from fe_models.elements.interfaces import nodes_interface as nodes_interface
from fe_models.elements.recovery.element_points import element_points as element_points

from .couplings.couplings import check_overlap as check_overlap
from .kept_nodes import keep_nodes as keep_nodes
from .material import AnisotropicMaterial as AnisotropicMaterial
from .material import OrthotropicMaterial as OrthotropicMaterial
