from .comparison_html import comparison_html as comparison_html
from .comparison_json import comparison_json as comparison_json
from .comparison_json import comparison_record as comparison_record
from .comparison_json import comparison_table as comparison_table
