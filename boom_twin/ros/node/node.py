"""The live twin: a lifecycle node around `Twin.update`."""

from __future__ import annotations

import gc
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import import_module
from time import perf_counter
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleNode, LifecyclePublisher, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription

from ...bag.session_model import scene_from
from ...config.settings import Settings, Thresholds
from ...errors import BoomTwinError
from ...messages.cdr_decoder import CdrDecoder
from ...messages.mapping import load_mapping
from ...messages.report_encoder import ReportEncoder
from ...messages.sample_decoder import SampleDecoder
from ...messages.topic_table import NODE, Output
from ...twin.twin import Twin
from ...types import SENSORS, Report, Sample, Stream
from ..receive import ReceiveQueue
from ..runtime import Log, message_class, one_line, qos_profile
from .beside import BackgroundTask, MonitorProcess
from .diagnostics import Diagnostics
from .parameters import current, declare, frame_of, guard, path_of, refusal
from .services import Services, StartLog

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class TwinNode(LifecycleNode):  # type: ignore[misc] # rclpy.lifecycle is not typed
    """Node ``boom_twin``: strokes, joint angles and tip IMU in, predictions and residuals out.

    It listens only while it is active and its model is ready, so a publisher that has matched its subscriptions is heard. The
    model advances by the stamps of the samples. No timer and no clock affects what is published, except on ``/diagnostics``.
    Compiling the model may take a minute. A thread does it after the transition to configure; the node may be activated
    meanwhile. Raise UsageError if a parameter given at start cannot be used.
    """

    def __init__(self) -> None:
        super().__init__(NODE)
        self._log = Log(self)
        self.finished = False  # after the transition to shut down
        self.failed = False  # the model could not be made
        self._is_configured = self._is_active = False
        self._making: BackgroundTask[Twin] | None = None
        self._twin: Twin | None = None
        self._page: MonitorProcess | None = None
        self._outputs: dict[Output, LifecyclePublisher] = {}
        self._subscriptions_in: list[Subscription[Any]] = []
        self._refused = ""
        transitions = next(each for each in self.services if each.service_name.endswith("/change_state"))
        transitions.callback = partial(self._change_state, transitions.callback)
        declare(self)
        self._topics = load_mapping(path_of(self, "mapping"))
        self.queue = ReceiveQueue()
        self._diagnostics = Diagnostics(self, self._topics, self.queue)
        self._diagnostics.watch.thresholds = current(self, Thresholds)
        guard(self, lambda: self._is_configured, self._tune)

    @property
    def autostart(self) -> bool:
        """Return True if the node is to configure and activate itself."""
        return bool(self.get_parameter("autostart").value)

    def set_parameters_atomically(self, parameter_list: list[Parameter[Any]]) -> SetParametersResult:
        """Set parameters as any node does; give a reason with fault and remedy where rclpy has none.

        A value that a parameter has already is accepted and changes nothing, also where the parameter is fixed.
        """
        if reason := refusal(self, parameter_list):
            return SetParametersResult(successful=False, reason=reason)
        now = [self.get_parameter_or(each.name) for each in parameter_list]
        pairs = zip(parameter_list, now, strict=True)
        changed = [new for new, old in pairs if (new.type_, new.value) != (old.type_, old.value)]
        return super().set_parameters_atomically(changed) if changed else SetParametersResult(successful=True)

    def start(self) -> bool:
        """Configure and activate the node; return True if both succeeded."""
        return bool(self.trigger_configure() == SUCCESS and self.trigger_activate() == SUCCESS)

    # -- transitions --------------------------------------------------------------------------------------------------

    def _change_state(self, change: Callable[..., Any], request: Any, response: Any) -> Any:
        """Carry out a transition asked for by service; refuse one that the present state lacks: rclpy would end the process."""
        try:
            return change(request, response)
        except RuntimeError as error:  # RCLError
            asked = request.transition.label or request.transition.id
            state = "active" if self._is_active else "inactive" if self._is_configured else "unconfigured"
            told = f"transition {asked} refused in state {'finalized' if self.finished else state}: {one_line(error)}"
            if told != self._refused:  # not a line for each of many
                self._log.warning(told)
            self._refused, response.success = told, False
            return response

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load the scene, offer the outputs, begin to make the model; on failure, log the reason and return FAILURE."""
        try:
            self._begin_making()
        except BoomTwinError as error:
            self._log.fatal(str(error))
            return FAILURE
        except Exception:  # rclpy would swallow it
            self._log.fatal(traceback.format_exc())
            raise
        for key, topic in self._topics.outputs.items():
            if key is not Output.DIAGNOSTICS:
                kind = message_class(topic.type)
                self._outputs[key] = self.create_lifecycle_publisher(kind, topic.name, qos_profile(topic.qos))
        if self.get_parameter("monitor").value:
            mapping, scene = (self.get_parameter(name).value for name in ("mapping", "scene"))
            self._page = MonitorProcess(self, self._topics, mapping, scene)
        self._is_configured, self.failed = True, False
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start listening, as soon as the model is ready; it starts from the next full stroke sample."""
        outcome = super().on_activate(state)
        self._is_active = True
        self._listen()
        return outcome

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop listening."""
        if self._twin is not None:
            self.queue.catch_up()
            for sample in self._decoder.assembler.rest():
                self._take(sample)
        self._stop_listening()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release the model and the outputs; parameters can be changed again."""
        self._discard()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything, from whatever state."""
        self._stop_listening()
        self._discard()
        self.finished = True
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything; the node can be configured again."""
        self._stop_listening()
        self._discard()
        return super().on_error(state)

    def leave(self) -> None:
        """Shut down from whatever state; leave an interrupted transition as it is."""
        with suppress(RuntimeError):  # RCLError: no transition goes on from here
            self.trigger_shutdown()

    def _begin_making(self) -> None:
        """Read scene, mapping and settings, and make the twin of them in a thread."""
        found = scene_from(path_of(self, "scene"))
        scene, name = found.scene, found.source
        for oddity in found.oddities:
            self._log.warning(str(oddity))
        settings, joints = current(self, Settings), len(scene.joints)
        topics = load_mapping(path_of(self, "mapping"), joints).of_scene(scene.joints)
        self._topics = self._topics.model_copy(update={"areas": topics.areas})
        health, causes = (self.get_parameter(key).value for key in ("health", "causes"))
        frame = frame_of(self, topics)

        def make() -> Twin:
            noise, sensing = topics.noise_of(settings), topics.sensing(joints)
            twin = Twin(scene, noise, health=health, causes=causes, is_live=True, **sensing)
            twin.warm_up()
            import_module("scipy.special")  # the first alarm and the first pause need it; their samples would wait 0.3 s
            return twin

        def use(twin: Twin) -> None:
            self._decoder = SampleDecoder(joints, topics)
            self._encoder = ReportEncoder(scene, settings, frame)
            self._diagnostics.configure(twin, self._decoder, name)
            acknowledge, is_heard = self._diagnostics.watch.acknowledge, lambda: bool(self._subscriptions_in)
            self._twin_services = Services(self, twin, acknowledge, is_heard, self.queue.catch_up, found.text)
            self._start_log = StartLog(self._log)
            self._twin = twin
            self._log.info("model ready")
            now = current(self, Settings)
            self._tune({key: getattr(now, key) for key in now.live_names() if getattr(now, key) != getattr(settings, key)})
            self._listen()

        self._log.info(f"{name}: {len(scene.sections)} sections; preparing the model (a minute at first start)")
        self._diagnostics.prepare()
        self._making = BackgroundTask(self, make, use, self._give_up)

    def _give_up(self, error: Exception) -> None:
        """Return to the state before configuring, because the model could not be made; log the reason."""
        self._log.fatal(str(error) if isinstance(error, BoomTwinError) else "".join(traceback.format_exception(error)))
        self.failed = True
        if self._is_active:
            self.trigger_deactivate()
        self.trigger_cleanup()

    def _listen(self) -> None:
        """Start listening, if the node is active and the model is ready."""
        if self._twin is None or not self._is_active:
            return
        self._twin.renew()
        self._diagnostics.start()
        gc.collect()
        gc.freeze()  # objects that live as long as the node are not collected again
        for name, streams in self._topics.streams_by_topic.items():
            topic = self._topics.inputs[streams[0]]
            kind, qos = message_class(topic.type), qos_profile(topic.qos)
            decoder = CdrDecoder(topic.type, field=SENSORS[streams[0]].field)
            put = self.queue.open(name, topic.qos.depth, partial(self._receive, streams, decoder))
            self._subscriptions_in.append(self.create_subscription(kind, name, put, qos, raw=True))
        heard = ", ".join(subscription.topic_name for subscription in self._subscriptions_in)
        self._log.info(f"active; listening to {heard}")

    def _tune(self, live: dict[str, float]) -> None:
        """Apply the live parameters that were set."""
        self._diagnostics.watch.thresholds = current(self, Thresholds)
        asked = {name: value for name, value in live.items() if name in Settings.live_names()}
        if asked and self._twin is not None:
            self.queue.catch_up()
            self._twin.requests.tune(asked)

    def _stop_listening(self) -> None:
        self._is_active = False
        self._diagnostics.stop()
        while self._subscriptions_in:
            self.destroy_subscription(self._subscriptions_in.pop())
        self.queue.close()
        gc.unfreeze()

    def _discard(self) -> None:
        for publisher in self._outputs.values():
            self.destroy_lifecycle_publisher(publisher)
        self._outputs.clear()
        self._is_configured = False
        if self._making is not None:
            self._making.abandon()
        if self._twin is not None:
            self._twin_services.close()
            self._twin.close()
        self._twin = None
        if self._page is not None:
            self._page.close()
        self._page = None

    # -- one message --------------------------------------------------------------------------------------------------

    def _receive(self, streams: list[Stream], decoder: CdrDecoder, data: bytes) -> None:
        """Take one message; the node survives whatever it holds."""
        try:
            (stamp, msg), refused = decoder.read(data), self._decoder.refused
            samples = self._decoder.samples(streams, stamp, msg)
            for stream in streams if self._decoder.refused > refused else ():
                self._diagnostics.watch.seen(Stream(SENSORS[stream].gives or stream), stamp - self._decoder.delays[stream])
            for sample in samples:
                self._take(sample)
        except Exception as error:  # the last resort, such as a message that is not whole
            told = f"a message of {streams[0].value} could not be handled: {type(error).__name__}: {error}"
            self._diagnostics.watch.broken(told)

    def _take(self, sample: Sample) -> None:
        assert self._twin is not None
        self._diagnostics.watch.seen(sample.stream, sample.stamp)
        began = perf_counter()
        report = self._twin.update(sample, judged=False)
        self._diagnostics.watch.took(sample, report, perf_counter() - began)
        if report.change is not None:
            self._start_log.tell(report, report.change)
        self._publish(report)
        if self._twin.is_health_due:
            self._judge(self._twin, sample.stamp)

    def _judge(self, twin: Twin, stamp: int) -> None:
        """Judge the rig's health. It takes about a millisecond, for which no prediction waits."""
        began = perf_counter()
        health = twin.judge_health()
        if health is not None:
            self._publish(Report(stamp, True, health=health))
        self._diagnostics.watch.judged(health, perf_counter() - began)

    def _publish(self, report: Report) -> None:
        """Publish the outputs that somebody listens to, or may ask for later.

        The node is active here, so the publishers' own check of its state is bypassed.
        """
        for key, encoded in self._encoder.fill(report, self._is_wanted):
            self._outputs[key].handle.publish_raw(encoded)

    def _is_wanted(self, key: Output) -> bool:
        is_heard: bool = self._outputs[key].handle.get_subscription_count() > 0
        return is_heard or self._topics.outputs[key].qos.durability == "transient_local"
