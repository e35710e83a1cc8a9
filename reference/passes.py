"""Renders passes of one scene with the `mitsuba` package. Used by render.py, and built into `lucerna check`.

Alone, it reads one job from standard input, as JSON:

    {"scene": FILE, "variant": NAME or "", "defines": {NAME: VALUE}, "size": [W, H] or null,
     "spp": N or [N, ...], "seeds": [S, ...], "threads": N}

(or an empty line, which asks for nothing but the version) and answers on standard output: one line of JSON with
`mitsuba` (its version), `variant`, `width`, `height`, `channels`, `notes`, or with `error`; and for each seed a little-endian
double (seconds) and the picture in float32, row-major from the top left corner, channels interleaved. An empty variant is
the fastest one that works here. `spp` is that of all pictures, or of each; in the second case time matters: what took
less than two seconds is rendered twice, the second time without compiling, and a last line of JSON has `cpu`, the seconds of
processor time of each picture, and `peak_mib`, the most memory of the process, if the system tells. `threads` may be left out.
"""
import json
import os
import struct
import sys
import time

# Samples that are traced at once: more need gigabytes of memory.
MOST_AT_ONCE = 1 << 23
# A filter wider than a pixel divides by the sum of its weights, whose bias falls with the samples per pixel.
FEWEST_SPP = 16
THREADS = 2  # the block size of small pictures depends on it


class Job:
    """One scene, loaded with a variant; renders passes as float32 arrays of shape (H, W, C)."""

    def __init__(self, scene, variant, defines, size=None, integrator=None, threads=None):
        import mitsuba as mi
        mi.set_log_level(mi.LogLevel.Error)
        mi.set_variant(variant)
        if threads or variant.startswith("scalar"):
            import drjit
            drjit.set_thread_count(threads or THREADS)
        self.mi, self.scene = mi, mi.load_file(str(scene), **defines)
        self.film = self.scene.sensors()[0].film()
        if size:
            parameters = mi.traverse(self.scene)
            for key in [k for k in parameters.keys() if k.endswith("film.size")]:
                parameters[key] = size
                parameters[key[:-len("size")] + "crop_size"] = size
                if key[:-len("size")] + "crop_offset" in parameters:
                    parameters[key[:-len("size")] + "crop_offset"] = [0, 0]
            parameters.update()
        self.integrator = mi.load_dict(integrator) if integrator else self.scene.integrator()

    def render(self, spp, seed):
        import numpy
        self.mi.render(self.scene, integrator=self.integrator, spp=spp, seed=seed)
        # All channels the film holds, as its file has them: `aov` returns fewer from render().
        image = numpy.array(self.film.bitmap(), dtype=numpy.float32)
        return numpy.atleast_3d(image)

    def render_in_parts(self, spp, seed):
        """As render, but in parts of equal length if the samples are many."""
        import numpy
        width, height = self.film.crop_size()
        parts = 1
        while width * height * (spp // parts) > MOST_AT_ONCE and spp % (2 * parts) == 0 \
                and spp // (2 * parts) >= FEWEST_SPP:
            parts *= 2
        total = 0.0
        for part in range(parts):
            # Seeds of a part are far from those of other passes.
            total = total + self.render(spp // parts, seed + 1_000_003 * part).astype(numpy.float64)
        return (total / parts).astype(numpy.float32)

    def channels(self):
        return [field.name for field in self.film.bitmap().struct_()]


def open_job(job):
    """The job's scene, with the fastest variant that works if none is named."""
    wanted = job["variant"]
    variants = [wanted] if wanted else ["llvm_ad_rgb", "scalar_rgb"]
    notes = []
    for variant in variants:
        try:
            if variant.startswith("llvm"):
                # Tells whether the compiler library is there, before a scene is blamed.
                import drjit
                import mitsuba as mi
                mi.set_variant(variant)
                drjit.eval(drjit.arange(drjit.llvm.Float, 4) + 1)
        except Exception as error:
            if variant == variants[-1]:
                raise
            notes.append(f"{variant} does not work here ({str(error).splitlines()[0][:100]})")
            continue
        return Job(job["scene"], variant, job["defines"], job["size"], threads=job.get("threads")), variant, notes


def measured(work):
    """What `work` gives, and the seconds of the clock and of all processors it took."""
    started, before = time.perf_counter(), time.process_time()
    result = work()
    return result, time.perf_counter() - started, time.process_time() - before


def peak_memory():
    try:
        with open("/proc/self/status") as status:
            return next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmHWM:"))
    except (OSError, StopIteration):
        return None


def serve():
    answer, sys_out = os.fdopen(os.dup(1), "wb"), sys.stderr
    os.dup2(2, 1)  # what the package prints is no answer
    sys.stdout = sys_out

    def say(**line):
        answer.write(json.dumps(line).encode() + b"\n")
        answer.flush()

    line = sys.stdin.readline().strip()
    try:
        import mitsuba as mi
        if not line:
            return say(mitsuba=mi.__version__)
        job = json.loads(line)
        opened, variant, notes = open_job(job)
        timed, cpu = isinstance(job["spp"], list), []
        counts = job["spp"] if timed else [job["spp"]] * len(job["seeds"])
        for index, (spp, seed) in enumerate(zip(counts, job["seeds"])):
            if index == 0 and not variant.startswith("scalar"):
                opened.render(1, 999_999)  # compiles, which is not rendering time
            image, seconds, processor = measured(lambda: opened.render_in_parts(spp, seed))
            if timed and seconds < 2:
                image, seconds, processor = measured(lambda: opened.render_in_parts(spp, seed))
            cpu.append(processor)
            if index == 0:
                say(mitsuba=mi.__version__, variant=variant, width=image.shape[1], height=image.shape[0],
                    channels=opened.channels(), notes=notes)
            answer.write(struct.pack("<d", seconds) + image.astype("<f4").tobytes())
            answer.flush()
        if timed:
            say(cpu=cpu, peak_mib=peak_memory())
    except Exception as error:
        lines = [text.strip() for text in str(error).splitlines() if text.strip()] or [type(error).__name__]
        say(error=" ".join(lines)[:500])


if __name__ == "__main__":
    serve()
