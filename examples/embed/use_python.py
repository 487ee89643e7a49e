"""Embeds the generated model as a Python module; PYTHONPATH names the folder that holds lowpass.py and liblowpass.so."""
from lowpass import Lowpass

model = Lowpass()
model.set_parameter("K.K", 0.2)
model.inputs.u = 1
for _ in range(11):
    model.step()
print("%.17g" % model.outputs.y)
