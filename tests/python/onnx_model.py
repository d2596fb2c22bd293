"""ONNX Runtime's predictions of the ONNX model given, for the records in the second file
(raw doubles), and what the model says of itself. onnx checks the model first. Prints JSON.
"""

import json
import sys

import numpy as np
import onnx
import onnxruntime

model = onnx.load(sys.argv[1])
onnx.checker.check_model(model, full_check=True)
session = onnxruntime.InferenceSession(sys.argv[1], providers=["CPUExecutionProvider"])
(source,), (target,) = session.get_inputs(), session.get_outputs()
metadata = {entry.key: entry.value for entry in model.metadata_props}
records = np.fromfile(sys.argv[2]).reshape(-1, source.shape[1])
(predicted,) = session.run([metadata["target"]], {source.name: records})
assert target.name == metadata["target"] and predicted.shape == (len(records), 1)
print(
    json.dumps(
        {
            "metadata": metadata,
            "producer": f"{model.producer_name} {model.producer_version}",
            "predicted": predicted[:, 0].astype(float).tolist(),
        }
    )
)
