from .comparison_document import comparison_document as comparison_document
from .comparison_json import comparison_json as comparison_json
from .comparison_json import comparison_record as comparison_record
