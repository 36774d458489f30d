"""What a master does with an FMU, in a process of its own; prints what it found as JSON.

python fmu_scenario.py arm.fmu 2
"""

import gc
import json
import sys

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

MOTOR, MASS, TURN = "forces.motor.motor", "bodies.arm.mass", "turn.angle"
STEP = 0.005


class Master:
    """The two versions of FMI alike."""

    def __init__(self, path, fmi):
        self.fmi, self.folder = fmi, fmpy.extract(path)
        self.description = fmpy.read_model_description(path)
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.log = []

    def new(self, name, **start):
        about = self.description
        kind, token = (FMU2Slave, about.guid) if self.fmi == 2 else (FMU3Slave, about.instantiationToken)
        fmu = kind(
            guid=token, unzipDirectory=self.folder, modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=name,
        )  # fmt: skip
        fmu.instantiate(loggingOn=True)
        try:
            self.begin(fmu, **start)
        except FMICallException:
            fmu.freeInstance()  # else its library is left to the end of the process, after that of Python
            raise
        return fmu

    def begin(self, fmu, **start):
        for key, value in start.items():
            self.set(fmu, key, value)
        if self.fmi == 2:
            fmu.setupExperiment(startTime=0.0)
            fmu.enterInitializationMode()
        else:
            fmu.enterInitializationMode(startTime=0.0)
        fmu.exitInitializationMode()

    def get(self, fmu, name):
        return (fmu.getReal if self.fmi == 2 else fmu.getFloat64)([self.reference[name]])[0]

    def set(self, fmu, name, value):
        (fmu.setReal if self.fmi == 2 else fmu.setFloat64)([self.reference[name]], [value])

    def steps(self, fmu, first, last):
        for k in range(first, last):
            fmu.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)

    def state(self, fmu, call, *values):
        """Call getFMUstate and its kin by the name of FMI 2; FMI 3 writes State, and deserialize in one word."""
        name = call if self.fmi == 2 else call.replace("FMUstate", "FMUState").replace("deSer", "deser")
        return getattr(fmu, name)(*values)


def failure(call):
    try:
        call()
    except FMICallException as error:
        return str(error)
    return "no error"


def main(path, fmi):
    master = Master(path, fmi)
    found = {}
    one, two = master.new("one"), master.new("two", **{MASS: 4.0})
    for k in range(10):  # in turns
        master.steps(one, k, k + 1)
        master.steps(two, k, k + 1)
    found["of one"], found["of two"] = master.get(one, TURN), master.get(two, TURN)

    kept = master.state(one, "getFMUstate")
    master.set(one, MOTOR, 300.0)
    master.steps(one, 10, 15)
    found["first try"] = master.get(one, TURN)
    master.state(one, "setFMUstate", kept)
    found["back"], found["motor back"] = master.get(one, TURN), master.get(one, MOTOR)
    master.set(one, MOTOR, 300.0)
    master.steps(one, 10, 15)
    found["second try"] = master.get(one, TURN)
    content = master.state(one, "serializeFMUstate", kept)
    read = master.state(one, "deSerializeFMUstate", content)
    three = master.new("three")
    master.state(three, "setFMUstate", read)
    master.set(three, MOTOR, 300.0)
    master.steps(three, 10, 15)
    found["from bytes"] = master.get(three, TURN)
    for each in (kept, read):
        master.state(one, "freeFMUstate", each)

    one.terminate()
    one.reset()
    master.begin(one)
    master.steps(one, 0, 10)
    found["after reset"] = master.get(one, TURN)
    one.terminate()
    one.freeInstance()

    master.set(two, MOTOR, 1e30)
    found["failed step"] = failure(lambda: master.steps(two, 10, 11))
    found["time of failed step"] = master.get(two, "time")
    master.set(two, MOTOR, 0.0)
    master.steps(two, 10, 11)
    found["after failed step"] = master.get(two, "time")
    found["parameter"] = failure(lambda: master.set(two, MASS, 3.0))
    found["nan"] = failure(lambda: master.set(three, MOTOR, float("nan")))
    found["mass"] = failure(lambda: master.new("heavy", **{MASS: -1.0}))
    failure(two.terminate)
    two.freeInstance()
    three.freeInstance()
    gc.collect()
    unit = sys.modules[f"floatframe_unit_fmi{fmi}"]
    found["released at exit"] = [path.suffix for path in unit.RELEASES]
    print("FOUND" + json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
