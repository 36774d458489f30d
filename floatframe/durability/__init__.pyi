from . import fatigue as fatigue
from . import shaking as shaking
