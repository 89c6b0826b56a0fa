//! Any bytes in the place of a datagram of a Z21: all are counted, and what is understood can be written again.

use footplate_wire::z21::{Datasets, Reply, Request};

pub(crate) fn fuzz(datagram: &[u8]) {
    let mut datasets = Datasets::of(datagram);
    let mut read = 0;
    for dataset in datasets.by_ref() {
        read += 4 + dataset.data.len();
        let mut again = Vec::new();
        if let Some(request) = Request::read(&dataset) {
            request.write(&mut again);
            assert_eq!(Datasets::of(&again).next().and_then(|one| Request::read(&one)), Some(request));
        }
        again.clear();
        if let Ok(Some(reply)) = Reply::read(&dataset) {
            reply.write(&mut again);
            assert_eq!(Datasets::of(&again).next().map(|one| Reply::read(&one)), Some(Ok(Some(reply))));
        }
    }
    assert_eq!(read + datasets.unread(), datagram.len());
}
