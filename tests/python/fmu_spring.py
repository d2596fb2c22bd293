"""One instance of an FMU's spring, with the same calls for both versions and both kinds.

Other scripts here import it. Errors of the FMU are FMICallException; `messages` holds what the FMU has
logged.
"""

import pathlib
import shutil
import struct
import tempfile
from ctypes import c_double

import fmpy
from fmpy.fmi1 import FMICallException  # noqa: F401, for those who import this
from fmpy.fmi2 import (
    FMU2Model,
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.fmi3 import FMU3Model, FMU3Slave, fmi3LogMessageCallback

OUTPUTS = ["force", "stored_energy", "dissipated_energy", "max_deflection"]


def from_bits(text):
    return struct.unpack(">d", bytes.fromhex(text))[0]


def to_bits(number):
    return struct.pack(">d", number).hex()


class Unpacked:
    """An FMU in a folder of its own, which goes when this is closed."""

    def __init__(self, path):
        self.folder = tempfile.mkdtemp()
        fmpy.extract(path, self.folder)
        self.description = fmpy.read_model_description(self.folder)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.version = int(self.description.fmiVersion[0])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.folder)


class Spring:
    """`kind` is "cs" or "me". With `is_started` it is initialized and ready to step."""

    def __init__(self, fmu, kind, is_started=True, events=False, token=None, stop=None, stiffness=None):
        self.fmu, self.kind, self.version = fmu, kind, fmu.version
        self.messages = []
        self.vr = fmu.references
        classes = {(2, "cs"): FMU2Slave, (2, "me"): FMU2Model, (3, "cs"): FMU3Slave, (3, "me"): FMU3Model}
        interface = fmu.description.coSimulation if kind == "cs" else fmu.description.modelExchange
        self.i = classes[self.version, kind](
            guid=token or fmu.description.guid,
            modelIdentifier=interface.modelIdentifier,
            unzipDirectory=fmu.folder,
            instanceName=pathlib.Path(fmu.folder).name,
        )
        if self.version == 2:
            def log(_environment, _name, _status, _category, message):
                self.messages.append(message.decode())

            self.callbacks = fmi2CallbackFunctions()
            self.callbacks.logger = fmi2CallbackLoggerTYPE(log)
            self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(0)
            self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(0)
            self.i.instantiate(callbacks=self.callbacks)
        else:
            def log(_environment, _status, _category, message):
                self.messages.append(message.decode())

            self.callbacks = fmi3LogMessageCallback(log)
            more = {"eventModeUsed": events} if kind == "cs" else {}
            self.i.instantiate(logMessage=self.callbacks, **more)
        self.time = 0.0
        if is_started:
            self.start(stop, stiffness=stiffness)
            if kind == "me":
                self.continuous()
            elif events:
                self.i.updateDiscreteStates()
                self.i.enterStepMode()

    def start(self, stop=None, deflection=None, stiffness=None, within=None):
        if self.version == 2:
            self.i.setupExperiment(startTime=0.0, stopTime=stop)
            self.i.enterInitializationMode()
        else:
            self.i.enterInitializationMode(startTime=0.0, stopTime=stop)
        if deflection is not None:
            self.set(deflection)
        if stiffness is not None:
            self.set(stiffness, "unloading_stiffness")
        if within is not None:
            within()
        self.i.exitInitializationMode()

    def continuous(self):
        self.events()
        self.i.enterContinuousTimeMode()

    def events(self):
        self.i.newDiscreteStates() if self.version == 2 else self.i.updateDiscreteStates()

    def set(self, value, name="deflection"):
        setter = self.i.setReal if self.version == 2 else self.i.setFloat64
        setter([self.vr[name]], [value])

    def get(self, *names):
        getter = self.i.getReal if self.version == 2 else self.i.getFloat64
        values = getter([self.vr[name] for name in names])
        return values if len(names) > 1 else values[0]

    def outputs(self):
        return self.get(*OUTPUTS)

    def step(self, step):
        """Goes on by one step of co-simulation, or accepts a point of model exchange."""
        if self.kind == "cs":
            self.i.doStep(self.time, step)
            self.time += step
        else:
            self.time += step
            self.i.setTime(self.time)
            self.i.completedIntegratorStep()

    def knots(self):
        """The event indicators of model exchange."""
        z = (c_double * 2)()
        self.i.getEventIndicators(z, 2)
        return list(z)

    def accept(self, time):
        """Accepts a point of model exchange; whether the FMU asks for an event there."""
        self.time = time
        self.i.setTime(time)
        answer = self.i.completedIntegratorStep()
        return bool(answer[0])

    def event(self):
        self.i.enterEventMode()
        self.continuous()

    def partial(self, unknown, known="deflection"):
        return self.i.getDirectionalDerivative([self.vr[unknown]], [self.vr[known]], [1.0])[0]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.i.terminate()
        self.i.freeInstance()
