"""Refines surfaces of mode random in ParaView as the camera moves: what is near is read in detail, and what is far is not.

In the Python shell of ParaView, with the compiled plug-in and a surface of mode random loaded and selected:

    import maille_camera
    following = maille_camera.follow()
    following.stop()
"""
import math

from paraview import simple


def look(reader, view, pixels=1):
    """Lets `reader` read what the camera of `view` sees, so that no error is larger than so many pixels.

    Takes effect when the pipeline is updated or rendered next. Returns whether anything changed.
    """
    camera = view.GetActiveCamera()
    height = view.ViewSize[1]
    if camera.GetParallelProjection():
        # All points are as large as they are, so one bound holds for all of them.
        wanted = {'AsSeen': 0, 'MaximumError': pixels * 2 * camera.GetParallelScale() / height}
    else:
        per_radian = height / (2 * math.tan(math.radians(camera.GetViewAngle()) / 2))
        wanted = {'AsSeen': 1, 'Eye': list(camera.GetPosition()), 'PixelsperRadian': per_radian, 'Pixels': pixels}
    changed = False
    for name, value in wanted.items():
        known = getattr(reader, name)
        if (list(known) if isinstance(value, list) else known) != value:
            setattr(reader, name, value)
            changed = True
    return changed


class Following:
    """Looks again whenever the camera comes to rest, until stop() is called."""

    def __init__(self, reader, view, pixels):
        self._reader, self._view, self._pixels = reader, view, pixels
        self._interactor = view.GetInteractor()
        if self._interactor is None:
            raise RuntimeError('the view has no window to move the camera in; call look() instead')
        self._observer = self._interactor.AddObserver('EndInteractionEvent', self._at_rest)
        self._at_rest()

    def _at_rest(self, *_):
        if look(self._reader, self._view, self._pixels):
            simple.Render(self._view)

    def stop(self):
        """The surface stays as it was seen last."""
        self._interactor.RemoveObserver(self._observer)


def follow(reader=None, view=None, pixels=1):
    """Follows the camera of a view (the active one) with a Maille reader (the active source); errors stay below so many pixels.

    Raises ValueError if the source is no Maille reader. Returns an object whose stop() ends it.
    """
    reader = reader or simple.GetActiveSource()
    if reader is None or not hasattr(reader, 'AsSeen'):
        raise ValueError('select a source that reads a .maille file with the compiled plug-in')
    return Following(reader, view or simple.GetActiveViewOrCreate('RenderView'), pixels)
