"""A robot of two joints of 1 kg m2 on a pseudo-terminal, whose name it prints: robot.py [SECONDS].

It sends `s1 s2 s_dot1 s_dot2` every ms; with a torque it moves, and without one for 0.1 s, or after `stop`, it brakes. When
it ends it prints the last positions and the last word that it heard."""
import os
import pty
import select
import sys
import time
import tty

near, far = pty.openpty()
tty.setraw(far)
os.set_blocking(near, False)
print(os.ttyname(far), flush=True)
s, s_dot, tau = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
begin = last = heard = time.monotonic()
text, word = b"", "nothing"
while last - begin < float(sys.argv[1] if len(sys.argv) > 1 else 20):
    time.sleep(0.001)
    now = time.monotonic()
    if select.select([near], [], [], 0)[0]:
        text += os.read(near, 4096)
        *lines, text = text.split(b"\n")
        for line in lines:
            word, *numbers = line.decode().split()
            tau, heard = [float(x) for x in numbers] if word == "torque" else [0.0, 0.0], now
    if now - heard > 0.1 or word == "stop":
        tau = [-20 * v for v in s_dot]
    for i in range(2):
        s_dot[i] += tau[i] * (now - last)
        s[i] += s_dot[i] * (now - last)
    last = now
    try:
        os.write(near, f"{s[0]:.6f} {s[1]:.6f} {s_dot[0]:.6f} {s_dot[1]:.6f}\n".encode())
    except BlockingIOError:  # nobody reads
        pass
    if word == "stop" and now - heard > 0.2:
        break
print(s[0], s[1], word)
