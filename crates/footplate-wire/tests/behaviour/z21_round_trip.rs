//! What is written is what is read, and noise is read without a panic.

use footplate_core::DecoderSteps;
use footplate_wire::z21::{
    Broadcasts, CanDetection, CentralState, Datasets, Firmware, FunctionSwitch, Lock, LocoNetDetection,
    LocomotiveState, RailCom, Reply, Request, SystemState, Throttle, TurnoutPosition,
};
use proptest::prelude::{Just, Strategy, any, prop_assert, prop_assert_eq, prop_oneof, proptest};

fn steps() -> impl Strategy<Value = DecoderSteps> {
    prop_oneof![Just(DecoderSteps::Fourteen), Just(DecoderSteps::TwentyEight), Just(DecoderSteps::All)]
}

/// Steps and a throttle that they can say.
fn throttles() -> impl Strategy<Value = (DecoderSteps, Throttle)> {
    (steps(), 0_u8..=126).prop_map(|(steps, step)| {
        let throttle = match step % (steps.highest().get() + 1) {
            0 if step % 2 == 0 => Throttle::Stop,
            0 => Throttle::EmergencyStop,
            step => Throttle::Step(step),
        };
        (steps, throttle)
    })
}

fn addresses() -> impl Strategy<Value = u16> {
    1_u16..=9_999
}

fn requests() -> impl Strategy<Value = Request> {
    let switches =
        prop_oneof![Just(FunctionSwitch::Off), Just(FunctionSwitch::On), Just(FunctionSwitch::Toggle)];
    prop_oneof![
        Just(Request::SerialNumber),
        Just(Request::Hardware),
        Just(Request::LockCode),
        Just(Request::LogOff),
        Just(Request::Broadcasts),
        Just(Request::SystemState),
        Just(Request::XBusVersion),
        Just(Request::Status),
        Just(Request::Firmware),
        Just(Request::StopAll),
        any::<u32>().prop_map(|bits| Request::SetBroadcasts(Broadcasts(bits))),
        any::<bool>().prop_map(|on| Request::Power { on }),
        addresses().prop_map(|address| Request::Locomotive { address }),
        (addresses(), throttles(), any::<bool>()).prop_map(|(address, (steps, throttle), forward)| {
            Request::Drive { address, steps, throttle, forward }
        }),
        (addresses(), 0_u8..=31, switches).prop_map(|(address, function, switch)| Request::Function {
            address,
            function,
            switch
        }),
        any::<u16>().prop_map(|address| Request::Turnout { address }),
        (any::<u16>(), any::<[bool; 3]>()).prop_map(|(address, [second, activate, queue])| {
            Request::SetTurnout { address, second, activate, queue }
        }),
        any::<u8>().prop_map(|group| Request::Feedback { group }),
        any::<u16>().prop_map(|network| Request::CanDetectors { network }),
        (any::<u8>(), any::<u16>()).prop_map(|(kind, address)| Request::LocoNetDetectors { kind, address }),
        any::<u16>().prop_map(|address| Request::RailCom { address }),
    ]
}

fn replies() -> impl Strategy<Value = Reply> {
    let firmware = || (any::<u8>(), any::<u8>()).prop_map(|(major, minor)| Firmware { major, minor });
    let locks = prop_oneof![Just(Lock::None), Just(Lock::Locked), Just(Lock::Unlocked)];
    let positions = prop_oneof![
        Just(TurnoutPosition::Unknown),
        Just(TurnoutPosition::Invalid),
        any::<bool>().prop_map(|second| TurnoutPosition::Output { second }),
    ];
    let locomotives = (addresses(), throttles(), any::<[bool; 2]>(), any::<u32>()).prop_map(
        |(address, (steps, throttle), [busy, forward], functions)| {
            Reply::Locomotive(LocomotiveState { address, busy, steps, throttle, forward, functions })
        },
    );
    let system =
        (any::<[i16; 4]>(), any::<[u16; 2]>(), any::<[u8; 3]>()).prop_map(|(signed, volts, bytes)| {
            let [main_ma, programming_ma, filtered_ma, temperature_c] = signed;
            let ([supply_mv, track_mv], [central, central_more, capabilities]) = (volts, bytes);
            let central = CentralState(central);
            Reply::SystemState(SystemState {
                main_ma,
                programming_ma,
                filtered_ma,
                temperature_c,
                supply_mv,
                track_mv,
                central,
                central_more,
                capabilities,
            })
        });
    let can =
        (any::<[u16; 4]>(), any::<[u8; 2]>()).prop_map(|([network, address, value, more], [port, kind])| {
            Reply::Can(CanDetection { network, address, port, kind, value, more })
        });
    let rail_com = (any::<[u16; 2]>(), any::<u32>(), any::<[u8; 3]>()).prop_map(
        |([address, errors], received, [options, speed, quality])| {
            Reply::RailCom(RailCom { address, received, errors, options, speed, quality })
        },
    );
    prop_oneof![
        any::<u32>().prop_map(Reply::SerialNumber),
        (any::<u32>(), firmware()).prop_map(|(kind, firmware)| Reply::Hardware { kind, firmware }),
        locks.prop_map(Reply::LockCode),
        any::<u32>().prop_map(|bits| Reply::Broadcasts(Broadcasts(bits))),
        system,
        any::<bool>().prop_map(|on| Reply::Power { on }),
        Just(Reply::Programming),
        Just(Reply::ShortCircuit),
        Just(Reply::Unknown),
        Just(Reply::Stopped),
        any::<u8>().prop_map(|bits| Reply::Status(CentralState(bits))),
        (any::<u8>(), any::<u8>()).prop_map(|(version, station)| Reply::XBusVersion { version, station }),
        firmware().prop_map(Reply::Firmware),
        locomotives,
        (any::<u16>(), positions).prop_map(|(address, position)| Reply::Turnout { address, position }),
        (any::<u8>(), any::<[u8; 10]>()).prop_map(|(group, inputs)| Reply::Feedback { group, inputs }),
        (any::<u8>(), any::<u16>(), any::<u16>())
            .prop_map(|(kind, address, info)| Reply::LocoNet(LocoNetDetection { kind, address, info })),
        can,
        rail_com,
    ]
}

proptest! {
    #[test]
    fn requests_are_read_as_written(written in proptest::collection::vec(requests(), 0..20)) {
        let mut datagram = Vec::new();
        written.iter().for_each(|request| request.write(&mut datagram));
        let mut datasets = Datasets::of(&datagram);
        let read: Vec<Request> = datasets.by_ref().map(|dataset| Request::read(&dataset).unwrap()).collect();
        prop_assert_eq!(read, written);
        prop_assert_eq!(datasets.unread(), 0);
    }

    #[test]
    fn replies_are_read_as_written(written in proptest::collection::vec(replies(), 0..20)) {
        let mut datagram = Vec::new();
        written.iter().for_each(|reply| reply.write(&mut datagram));
        let read: Vec<Reply> =
            Datasets::of(&datagram).map(|dataset| Reply::read(&dataset).unwrap().unwrap()).collect();
        prop_assert_eq!(read, written);
        prop_assert!(Datasets::of(&datagram).all(|dataset| dataset.is_sound()));
    }

    #[test]
    fn what_is_understood_of_noise_can_be_written_again(datagram in proptest::collection::vec(any::<u8>(), 0..200)) {
        let mut datasets = Datasets::of(&datagram);
        let mut read = 0;
        for dataset in datasets.by_ref() {
            read += 4 + dataset.data.len();
            let mut again = Vec::new();
            if let Some(request) = Request::read(&dataset) {
                request.write(&mut again);
                prop_assert_eq!(Request::read(&Datasets::of(&again).next().unwrap()), Some(request));
            }
            again.clear();
            if let Ok(Some(reply)) = Reply::read(&dataset) {
                reply.write(&mut again);
                prop_assert_eq!(Reply::read(&Datasets::of(&again).next().unwrap()), Ok(Some(reply)));
            }
        }
        prop_assert_eq!(read + datasets.unread(), datagram.len());
    }
}
