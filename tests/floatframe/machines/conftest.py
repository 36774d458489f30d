import pytest

import cms
from floatframe.machines import copy_machine


@pytest.fixture(scope="module")
def gear_folder(tmp_path_factory):
    """The landing gear with its reduced piston."""
    place = tmp_path_factory.mktemp("gear")
    copy_machine("landing-gear", place)
    cms.write(cms.reduce_job(place / "piston.toml"), place / "piston.h5")
    return place
